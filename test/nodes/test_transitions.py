# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Transitions that are asked for: those that fail, and those that are not possible."""

from __future__ import annotations

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState

from gait_segmentation.nodes.segmenter_node import SegmenterNode
from test.nodes.bench import Bench

CONFIGURE, ACTIVATE = Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE


def change(bench: Bench, number: int) -> bool:
    client = bench.probe.create_client(ChangeState, 'gait_segmenter/change_state')
    bench.until(client.service_is_ready, 'the service')
    answer = client.call_async(ChangeState.Request(transition=Transition(id=number)))
    bench.until(answer.done, 'the answer')
    return bool(answer.result().success)


def test_a_transition_that_is_not_possible_is_refused(bench: Bench, capfd) -> None:
    node = bench.add(SegmenterNode, start=False, autostart=False)
    assert node.start()
    assert not change(bench, ACTIVATE)
    assert 'a request to /gait_segmenter/change_state is refused: ' in capfd.readouterr().err
    assert change(bench, CONFIGURE)
    assert not change(bench, CONFIGURE)
    assert change(bench, ACTIVATE)
    assert node.state == 'active'


def test_what_cannot_be_compiled_leaves_the_node_unconfigured(
    bench: Bench, monkeypatch, capfd
) -> None:
    def fail() -> None:
        raise MemoryError('no room')

    node = bench.add(SegmenterNode, start=False)
    with monkeypatch.context() as patch:
        patch.setattr(node, 'compile', fail)
        assert not change(bench, CONFIGURE)
    assert node.state == 'unconfigured'
    assert 'configuring failed: MemoryError: no room' in capfd.readouterr().err
    assert node.start()
    assert node.state == 'active'

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""While a node compiles it answers, and says so."""

from __future__ import annotations

import threading
import time
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.srv import DescribeParameters

from gait_segmentation.nodes.segmenter_node import SegmenterNode
from gait_segmentation.ros.executor import MessageExecutor
from test.nodes.bench import Bench

NAME = 'gait_segmenter'
CONFIGURE, ACTIVATE = Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE


class Compiling:
    """A node whose kernels take as long as the test wants."""

    def __init__(self, bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
        self.bench = bench
        self.begun, self.finish = threading.Event(), threading.Event()
        self.error: Exception | None = None
        self.node = bench.add(SegmenterNode, start=False)
        monkeypatch.setattr(self.node, 'compile', self._compile)

    def _compile(self) -> None:
        self.begun.set()
        assert self.finish.wait(300)
        if self.error is not None:
            raise self.error

    def ask(self, kind: Any, name: str, request: Any) -> Any:
        """Call a service of the node; return the future of its answer."""
        client = self.bench.probe.create_client(kind, f'{NAME}/{name}')
        self.bench.until(client.service_is_ready, name)
        return client.call_async(request)

    def answer(self, kind: Any, name: str, request: Any) -> Any:
        """Call a service of the node; return its answer."""
        future = self.ask(kind, name, request)
        self.bench.until(future.done, f'the answer of {name}')
        return future.result()

    def change(self, number: int) -> Any:
        """Ask for a transition; return the future of the answer."""
        request = ChangeState.Request(transition=Transition(id=number))
        return self.ask(ChangeState, 'change_state', request)

    def check_answers(self) -> None:
        """Make sure that the node answers and reports that it compiles."""
        self.bench.until(self.begun.is_set, 'the compiler')
        state = self.answer(GetState, 'get_state', GetState.Request())
        assert state.current_state.label == 'configuring'
        described = self.answer(
            DescribeParameters,
            'describe_parameters',
            DescribeParameters.Request(names=['backlog']),
        )
        assert described.descriptors[0].name == 'backlog'
        reports = self.bench.record(DiagnosticArray, '/diagnostics')
        reports.clear()
        self.bench.until(lambda: bool(reports), 'a report')
        (status,) = reports[0].status
        assert status.level == DiagnosticStatus.OK
        assert status.message.startswith('configuring, compiling: ')
        assert status.message.endswith(' kernels ready')


@pytest.fixture
def compiling(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> Any:
    made = Compiling(bench, monkeypatch)
    yield made
    made.finish.set()


def test_a_node_that_starts_itself_answers_while_it_compiles(
    bench: Bench, compiling: Compiling
) -> None:
    started = bench.executor.create_task(compiling.node.start_beside)
    compiling.check_answers()
    # Comes when there is nothing to be done any more.
    refused = compiling.change(ACTIVATE)
    assert not started.done()
    compiling.finish.set()
    bench.until(started.done, 'the start')
    assert (started.result(), compiling.node.state) == (True, 'active')
    bench.until(refused.done, 'the answer')
    assert not refused.result().success
    assert compiling.node.state == 'active'


def test_a_node_goes_on_as_soon_as_it_has_compiled(bench: Bench, compiling: Compiling) -> None:
    node = compiling.node
    bench.executor.remove_node(node)
    # Nothing else wakes the executor.
    for timer in list(node.timers):
        node.destroy_timer(timer)
    executor = MessageExecutor(context=node.context)
    executor.add_node(node)
    started = executor.create_task(node.start_beside)
    started.add_done_callback(lambda _: executor.shutdown(0.0))
    spinning = threading.Thread(target=executor.spin, daemon=True)
    spinning.start()
    assert compiling.begun.wait(60)
    # Until it waits for messages, which takes it one turn.
    time.sleep(0.5)
    compiling.finish.set()
    spinning.join(30)
    assert not spinning.is_alive()
    assert (started.result(), node.state) == (True, 'active')


def test_a_node_that_is_configured_answers_meanwhile_and_when_it_is_done(
    bench: Bench, compiling: Compiling
) -> None:
    configured = compiling.change(CONFIGURE)
    compiling.check_answers()
    activated = compiling.change(ACTIVATE)
    assert not configured.done()
    compiling.finish.set()
    bench.until(lambda: configured.done() and activated.done(), 'the answers')
    assert (configured.result().success, activated.result().success) == (True, True)
    assert compiling.node.state == 'active'


def test_what_cannot_be_compiled_leaves_the_node_unconfigured(
    bench: Bench, compiling: Compiling, capfd
) -> None:
    compiling.error = MemoryError('no room')
    configured = compiling.change(CONFIGURE)
    bench.until(compiling.begun.is_set, 'the compiler')
    compiling.finish.set()
    bench.until(configured.done, 'the answer')
    assert (configured.result().success, compiling.node.state) == (False, 'unconfigured')
    assert 'configuring failed: MemoryError: no room' in capfd.readouterr().err
    compiling.error = None
    assert compiling.node.start()
    assert compiling.node.state == 'active'


def test_a_node_is_done_with_a_start_that_is_not_its_own(bench: Bench) -> None:
    node = bench.add(SegmenterNode, start=False, autostart=False)
    started = bench.executor.create_task(node.start_beside)
    bench.until(started.done, 'the start')
    assert (started.result(), node.state) == (True, 'unconfigured')

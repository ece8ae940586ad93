# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the segmenter publishes of frames, usable or not, and when it starts anew."""

from __future__ import annotations

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.parameter import Parameter
from sensor_msgs.msg import Image, JointState
from std_srvs.srv import SetBool

from gait_segmentation.geometry import Box
from gait_segmentation.inputs.encodings import read_mono8
from gait_segmentation.nodes.segmenter_node import SegmenterNode
from gait_segmentation.ros.messages import box_message, image_message
from test.nodes.bench import Bench, frame, header

MASKS = ('mask', 'person_0/mask', 'labels')
SMALL, LARGE = (160, 120), (320, 240)
BODY = Box(30, 20, 24, 80)


class Cutter:
    """A segmenter to which parts of frames are handed over in the process."""

    def __init__(self, bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
        self.bench = bench
        self.node = bench.add(SegmenterNode)
        bench.record_outputs(*MASKS)
        self.resets = 0
        reset = self.node.stage.reset

        def counted() -> None:
            self.resets += 1
            reset()

        monkeypatch.setattr(self.node.stage, 'reset', counted)

    def show(
        self,
        index: int,
        size: tuple[int, int] = SMALL,
        image: Image | None = None,
        box: Box | None = None,
    ) -> list[np.ndarray]:
        """Hand a frame with a person over; return the masks that come."""
        about = header(index)
        body = BODY.shifted(2 * index, 0)
        inside = np.zeros(size[::-1], np.uint8)
        inside[body.slices(*size)] = 255
        self.node._part('image', frame(index, size) if image is None else image)
        self.node._part('person_0/likelihood', image_message(inside, about))
        self.node._part('person_0/matched_box', box_message((box or body).corners(), 7, about))
        self.node._part('person_0/shape_prior', image_message(inside, about))
        self.node._part('person_0/gait', JointState(header=about))
        self.bench.settle()
        messages = [self.bench.received[topic][-1] for topic in MASKS]
        assert [message.header for message in messages] == [about] * len(MASKS)
        return [read_mono8(message) for message in messages]


@pytest.fixture
def cutter(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> Cutter:
    return Cutter(bench, monkeypatch)


def test_another_size_of_the_image_starts_anew(cutter: Cutter, capfd) -> None:
    for index in range(2):
        cutter.show(index)
    assert cutter.resets == 0
    masks = cutter.show(2, LARGE)
    assert cutter.resets == 1
    assert [mask.shape for mask in masks] == [LARGE[::-1]] * len(MASKS)
    assert masks[0].any()
    assert 'the image size changed: starting anew' in capfd.readouterr().err
    cutter.show(3, LARGE)
    assert cutter.resets == 1


STRANGE = {
    'encoding': {'height': 120, 'width': 160, 'encoding': 'nonsense', 'step': 480},
    'empty, but claims much': {'height': 8192, 'width': 8192, 'encoding': 'bgr8', 'step': 24576},
}


@pytest.mark.parametrize('name', STRANGE)
def test_an_image_that_cannot_be_used_gives_empty_masks_of_the_last_size(
    cutter: Cutter, name: str
) -> None:
    cutter.show(0)
    for mask in cutter.show(1, image=Image(header=header(1), **STRANGE[name])):
        assert mask.shape == SMALL[::-1]
        assert not mask.any()
    assert cutter.show(2)[0].any()
    assert cutter.resets == 0
    assert cutter.node.statistics.failed == 1


def test_an_image_of_more_pixels_than_allowed_is_refused(cutter: Cutter, capfd) -> None:
    limit = Parameter('max_pixels', value=SMALL[0] * SMALL[1])
    assert cutter.node.set_parameters([limit])[0].successful
    assert cutter.show(0)[0].any()
    assert not cutter.show(1, LARGE)[0].any()
    assert 'at most 19200 pixels (max_pixels), got 320 x 240' in capfd.readouterr().err
    assert cutter.show(2)[0].any()


def test_a_huge_box_gives_empty_masks_and_is_forgotten(cutter: Cutter, capfd) -> None:
    assert cutter.show(0)[0].any()
    assert not cutter.show(1, box=Box(-5e29, -5e29, 1e30, 1e30))[0].any()
    assert 'body must be finite, at most 15360 pixels high' in capfd.readouterr().err
    assert cutter.show(2)[0].any()
    assert cutter.node.statistics.failed == 1


def enable(node: SegmenterNode, data: bool) -> None:
    assert node._enable(SetBool.Request(data=data), SetBool.Response()).success


def show_nobody(node: SegmenterNode, index: int) -> None:
    """Hand over all parts of a frame without anybody but the image."""
    about = header(index)
    empty = image_message(np.zeros((60, 80), np.uint8), about)
    node._part('person_0/likelihood', empty)
    node._part('person_0/matched_box', box_message((), 0, about))
    node._part('person_0/shape_prior', empty)
    node._part('person_0/gait', JointState(header=about))


def test_silence_upstream_is_said_as_such_and_is_no_reason_for_more_room(
    bench: Bench, capfd
) -> None:
    """As where gait_tracker is disabled."""
    node = bench.add(SegmenterNode, keep_images=2)
    show_nobody(node, 0)
    for index in range(8):
        node._part('image', frame(index))
    bench.settle()
    assert (node.statistics.processed, node.statistics.skipped) == (1, 5)
    said = capfd.readouterr().err
    assert 'gait_tracker said nothing of' in said
    assert 'raise keep_images' not in said


def test_the_diagnostics_say_whom_a_node_waits_for(bench: Bench, monkeypatch) -> None:
    node = bench.add(SegmenterNode)
    for topics in node.topics.values():
        for topic, kind in topics.items():
            bench.probe.create_publisher(kind, topic, 10)
    bench.publisher(Image, 'image', 1)
    names = [name for topics in node.topics.values() for name in topics]
    bench.until(lambda: all(node.count_publishers(f'/{name}') for name in names), 'publishers')
    node._part('image', frame(0))
    reports = bench.record(DiagnosticArray, '/diagnostics')
    monkeypatch.setattr(node.statistics, 'quiet_s', lambda now_s: 24.0)
    reports.clear()
    bench.until(lambda: bool(reports), 'a report')
    (status,) = reports[0].status
    assert status.level == DiagnosticStatus.STALE
    said = 'no input for 24 s: nothing to do: nothing comes from gait_tracker; is it active and en'
    assert status.message.startswith(said)


def test_what_waited_when_a_node_was_disabled_is_not_missed(bench: Bench) -> None:
    node = bench.add(SegmenterNode)
    for index in range(2):
        node._part('image', frame(index))
    show_nobody(node, 0)
    enable(node, False)
    show_nobody(node, 1)
    enable(node, True)
    node._part('image', frame(2))
    show_nobody(node, 2)
    bench.settle()
    about = node.statistics
    assert (about.processed, about.skipped, about.incomplete) == (2, 0, 0)

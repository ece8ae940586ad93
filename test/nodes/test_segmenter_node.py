# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the segmenter publishes of frames, usable or not, and when it starts anew."""

from __future__ import annotations

from itertools import count

import numpy as np
import pytest
from rclpy.parameter import Parameter
from sensor_msgs.msg import Image, JointState
from std_srvs.srv import SetBool

from gait_segmentation.encodings import read_mono8
from gait_segmentation.geometry import Box
from gait_segmentation.nodes.segmenter_node import SegmenterNode
from gait_segmentation.ros.diagnostics import Warnings
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
        self.node.receive('image', frame(index, size) if image is None else image)
        self.node.receive('person_0/likelihood', image_message(inside, about))
        self.node.receive('person_0/matched_box', box_message((box or body).corners(), 7, about))
        self.node.receive('person_0/shape_prior', image_message(inside, about))
        self.node.receive('person_0/gait', JointState(header=about))
        self.bench.settle()
        messages = [self.bench.received[topic][-1] for topic in MASKS]
        assert [message.header for message in messages] == [about] * len(MASKS)
        return [read_mono8(message) for message in messages]


@pytest.fixture
def cutter(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> Cutter:
    return Cutter(bench, monkeypatch)


def test_frames_that_cannot_be_used_give_empty_masks_of_the_last_size(cutter: Cutter) -> None:
    said: list[str] = []
    # Each warning long after the one before.
    cutter.node.warnings = Warnings(said.append, count(step=100).__next__)
    limit = Parameter('max_pixels', value=SMALL[0] * SMALL[1])
    assert cutter.node.set_parameters([limit])[0].successful
    assert cutter.show(0)[0].any()
    empty = {'height': 100, 'width': 190, 'encoding': 'bgr8', 'step': 570}
    unusable = [
        ({'image': Image(header=header(1), **empty)}, SMALL, 'at least 57000 bytes'),
        ({'size': LARGE}, LARGE, 'at most 19200 pixels (max_pixels), got 320 x 240'),
        ({'box': Box(-5e29, -5e29, 1e30, 1e30)}, SMALL, 'body must be finite, at most 15360'),
    ]
    for index, (change, size, why) in enumerate(unusable, start=1):
        for mask in cutter.show(index, **change):
            assert mask.shape == size[::-1]
            assert not mask.any()
        assert why in said[-1]
    assert cutter.show(4)[0].any()
    assert (cutter.resets, cutter.node.statistics.failed) == (0, 3)
    # What can be used of another size starts anew, once.
    cutter.node.set_parameters([Parameter('max_pixels', value=LARGE[0] * LARGE[1])])
    for index in (5, 6):
        assert cutter.show(index, LARGE)[0].any()
        assert cutter.resets == 1


def show_nobody(node: SegmenterNode, index: int) -> None:
    """Hand over all parts of a frame without anybody but the image."""
    about = header(index)
    empty = image_message(np.zeros((60, 80), np.uint8), about)
    node.receive('person_0/likelihood', empty)
    node.receive('person_0/matched_box', box_message((), 0, about))
    node.receive('person_0/shape_prior', empty)
    node.receive('person_0/gait', JointState(header=about))


def test_silence_upstream_is_said_and_counted(bench: Bench, capfd) -> None:
    """As where gait_tracker is disabled."""
    node = bench.add(SegmenterNode, keep_images=2)
    show_nobody(node, 0)
    for index in range(8):
        node.receive('image', frame(index))
    bench.settle()
    assert (node.statistics.processed, node.statistics.dropped) == (1, 5)
    assert 'gait_tracker said nothing of' in capfd.readouterr().err


def test_what_waited_when_a_node_was_disabled_is_not_missed(bench: Bench) -> None:
    node = bench.add(SegmenterNode)
    for index in range(2):
        node.receive('image', frame(index))
    show_nobody(node, 0)
    assert bench.call(SetBool, 'gait_segmenter/enable', SetBool.Request(data=False)).success
    show_nobody(node, 1)
    assert bench.call(SetBool, 'gait_segmenter/enable', SetBool.Request(data=True)).success
    node.receive('image', frame(2))
    show_nobody(node, 2)
    bench.settle()
    about = node.statistics
    assert (about.processed, about.dropped) == (2, 0)

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The open door: boxes and likelihoods of other nodes."""

from __future__ import annotations

import numpy as np
import pytest
from geometry_msgs.msg import PolygonInstanceStamped
from rclpy.parameter import Parameter
from sensor_msgs.msg import Image, RegionOfInterest

from gait_segmentation.geometry import Box
from gait_segmentation.nodes.matcher_node import MatcherNode
from gait_segmentation.ros.messages import box_message, image_message
from gait_segmentation.ros.qos import LATCHED
from gait_segmentation.streams.fields import read_body, read_box
from test.nodes.bench import DEEP, Bench, header

OUTPUTS = ('person_0/matched_box', 'person_0/refined_box', 'person_0/shape_prior', 'person_0/gait')
BOX = Box(80, 40, 60, 160)


class Door:
    def __init__(self, bench: Bench, **parameters) -> None:
        self.bench = bench
        self.node = bench.add(MatcherNode, **parameters)
        bench.record_outputs(*OUTPUTS)
        self.boxes = bench.publisher(PolygonInstanceStamped, 'person_0/box', 1)
        self.likelihoods = bench.publisher(Image, 'person_0/likelihood', 1)

    def publish(self, index: int, scale: float, box: Box | None = BOX) -> None:
        """Publish a likelihood of a source of 320 x 240 pixels."""
        likelihood = np.zeros((round(240 * scale), round(320 * scale)), np.uint8)
        if box is not None:
            likelihood[box.scaled(scale).slices(*likelihood.shape[::-1])] = 255
        corners = () if box is None else box.corners()
        self.boxes.publish(box_message(corners, 4, header(index)))
        self.likelihoods.publish(image_message(likelihood, header(index)))

    def wait(self, count: int) -> None:
        received = self.bench.received
        self.bench.until(
            lambda: all(len(received[topic]) >= count for topic in OUTPUTS), f'{count} outputs'
        )

    def heights(self) -> list[float]:
        return [read_body(m).height for m in self.bench.received['person_0/matched_box']]


def test_without_a_size_the_likelihood_has_that_of_the_source(bench: Bench) -> None:
    door = Door(bench)
    door.publish(0, 1.0)
    door.wait(1)
    assert door.heights()[0] == pytest.approx(160, rel=0.2)
    (box,) = bench.received['person_0/refined_box']
    assert box.polygon.id == 4
    # It is about what is likely, however narrow the template is.
    assert read_box(box)[0].iou(BOX) > 0.9


def test_before_the_size_that_somebody_publishes_nothing_is_matched(bench: Bench) -> None:
    sizes = bench.probe.create_publisher(RegionOfInterest, 'image_size', LATCHED)
    bench.until(lambda: bench.probe.count_publishers('image_size') == 1, 'image_size')
    door = Door(bench)
    bench.until(lambda: sizes.get_subscription_count() == 1, 'image_size')
    # Without an image there is a size of nothing.
    sizes.publish(RegionOfInterest())
    door.publish(0, 0.5)
    door.wait(1)
    sizes.publish(RegionOfInterest(width=320, height=240))
    bench.settle()
    door.publish(1, 0.5)
    door.wait(2)
    early, late = bench.received['person_0/matched_box']
    assert not early.polygon.polygon.points
    assert read_body(late).height == pytest.approx(160, rel=0.2)
    assert [m.header for m in bench.received['person_0/gait']] == [header(0), header(1)]


@pytest.mark.parametrize('ends', ['jump', 'reset', 'deactivated', 'parameter'])
def test_what_the_lag_holds_back_comes_before_the_paths_end(bench: Bench, ends) -> None:
    door = Door(bench, **{'matching.lag': 2})
    for index in range(4):
        door.publish(index, 1.0)
    door.wait(2)
    if ends == 'jump':
        door.publish(-60, 1.0)
    elif ends == 'reset':
        door.node.later(door.node.reset)
    elif ends == 'deactivated':
        door.node.trigger_deactivate()
    else:
        (result,) = door.node.set_parameters([Parameter('matching.view_cost', value=0.2)])
        assert result.successful
        bench.settle()
        assert door.node.stage.config.view_cost == 0.2
    door.wait(4)
    bench.settle()
    headers = [m.header for m in bench.received['person_0/gait']]
    assert headers == [header(index) for index in range(4)]
    # What was held back does not come again.


ABSURD = {
    'huge': ((30.0, 20.0), (54.0, 20.0), (54.0, 1e12), (30.0, 1e12)),
    'far away': ((3e30, 20.0), (3e30, 20.0), (3e30, 99.0), (3e30, 99.0)),
    'crossed': ((141.7, 12.3), (1e30, -27.4), (187.0, -1e30), (128.3, 1e30)),
    'thin': ((50.0, 0.25), (90.0, 0.25), (90.0, 0.55), (50.0, 0.55)),
    'three corners': BOX.corners()[:3],
}


@pytest.mark.parametrize('size', [(320, 240), (2**32 - 1, 120)], ids=['size', 'huge size'])
def test_what_cannot_be_used_gives_empty_outputs(bench: Bench, size: tuple[int, int]) -> None:
    sizes = bench.probe.create_publisher(RegionOfInterest, 'image_size', LATCHED)
    door = Door(bench)
    bench.until(lambda: sizes.get_subscription_count() == 1, 'image_size')
    sizes.publish(RegionOfInterest(width=size[0], height=size[1]))
    bench.settle()
    for index, corners in enumerate(ABSURD.values()):
        door.boxes.publish(box_message(corners, 4, header(index)))
        door.likelihoods.publish(image_message(np.full((120, 160), 40, np.uint8), header(index)))
    last = len(ABSURD)
    door.boxes.publish(box_message(BOX.corners(), 4, header(last)))
    door.likelihoods.publish(image_message(np.zeros((7, 160), np.uint8), header(last)))
    door.publish(last + 1, 0.5)
    door.wait(last + 2)
    # Nothing fits a size that is absurd itself.
    good = 4 if size == (320, 240) else 0
    for topic in ('person_0/matched_box', 'person_0/refined_box'):
        counts = [len(m.polygon.polygon.points) for m in bench.received[topic]]
        assert counts == [0] * (last + 1) + [good]
    headers = [m.header for m in bench.received['person_0/gait']]
    assert headers == [header(index) for index in range(last + 2)]


def test_a_size_that_is_not_latched_is_said_to_be_unheard(bench: Bench, capfd) -> None:
    node = bench.add(MatcherNode)
    bench.probe.create_publisher(RegionOfInterest, 'image_size', DEEP)
    bench.until(lambda: 'image_size' in node.warnings.said_s, 'the warning')
    said = capfd.readouterr().err
    assert 'a publisher on image_size offers an incompatible QoS (DURABILITY)' in said
    assert 'it must be reliable and transient local' in said

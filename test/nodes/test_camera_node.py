# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whose boxes and which heat maps are let in."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
from sensor_msgs.msg import Image
from std_srvs.srv import Trigger

from gait_segmentation.geometry import Box
from gait_segmentation.nodes.camera_node import MapIntake, new_people, read_detections
from gait_segmentation.nodes.tracker_node import TrackerNode
from gait_segmentation.results import TrackResult
from gait_segmentation.streams.config import StartConfig
from test.nodes.bench import Bench, frame


def track(track_id: int, box: Box | None, confidence: float = 0.75) -> TrackResult:
    return TrackResult(5, track_id, box, np.zeros((2, 2), np.uint8), confidence, 0.1)


def detection(score: float, box: tuple[float, ...], name: str = 'person') -> Any:
    x, y, width, height = box
    hypothesis = SimpleNamespace(class_id=name, score=score)
    center = SimpleNamespace(position=SimpleNamespace(x=x, y=y), theta=0.0)
    return SimpleNamespace(
        results=[SimpleNamespace(hypothesis=hypothesis)],
        bbox=SimpleNamespace(center=center, size_x=width, size_y=height),
    )


def test_people_come_in_the_surest_first() -> None:
    nothing = detection(0.9, (5, 5, 4, 4))
    nothing.results = []
    message = SimpleNamespace(
        detections=[
            detection(0.6, (50, 50, 20, 40)),
            detection(0.9, (10, 20, 4, 8)),
            detection(0.4, (10, 20, 4, 9)),
            detection(float('nan'), (10, 20, 4, 9)),
            detection(0.9, (10, 20, 0, 8)),
            detection(0.9, (float('nan'), 20, 4, 8)),
            detection(0.99, (10, 20, 4, 8), 'dog'),
            nothing,
        ]
    )
    assert read_detections(message, StartConfig()) == [Box(8, 16, 4, 8), Box(40, 30, 20, 40)]
    every = read_detections(message, StartConfig(detection_class='', detection_score=0.95))
    assert every == [Box(8, 16, 4, 8)]


def test_only_new_people_start_and_only_in_free_slots() -> None:
    known, near, far = Box(10, 10, 20, 60), Box(12, 11, 20, 60), Box(100, 10, 20, 60)
    further = Box(200, 10, 20, 60)
    assert new_people([near, far], [track(1, known), track(0, None)], 2) == [far]
    assert new_people([near, far], [track(1, known)], 1) == []
    assert new_people([far, far, further], [], 3) == [far, further]
    assert new_people([far, further], [track(3, None)], 2) == [far]
    # What another message has asked for just before takes a slot, too.
    assert new_people([far, further], [], 3, [far]) == [further]
    assert new_people([far, further], [], 1, [near]) == []


def test_a_detector_that_cannot_be_loaded_is_told_from_the_start(bench: Bench) -> None:
    node = bench.add(TrackerNode, **{'detector.network': 'none.onnx'})
    assert 'detector' in node.warnings.said_s
    bench.record_outputs('person_0/box')
    camera = bench.publisher(Image, 'image', 1)
    # A reset leaves it so, and has it tried again.
    for first in (0, 30):
        assert node.trouble.startswith('nobody is found by the detector: none.onnx cannot be')
        assert node.status()['detector'] == 'has not looked'
        for index in range(first, first + 30):
            bench.feed(camera, [frame(index)])
        assert node.status()['detector'].startswith('none.onnx cannot be loaded')
        assert node.trouble.endswith(node.status()['detector'])
        bench.call(Trigger, 'gait_tracker/reset', Trigger.Request())
        bench.settle()


def map_message(second: int, encoding: str = 'mono8', value: float = 255) -> Any:
    kind = np.float32 if encoding == '32FC1' else np.uint8
    data = np.full((4, 6), value, kind)
    header = SimpleNamespace(stamp=SimpleNamespace(sec=second, nanosec=0), frame_id='')
    return SimpleNamespace(
        header=header, height=4, width=6, encoding=encoding, is_bigendian=0,
        step=data.strides[0], data=data.tobytes(),
    )  # fmt: skip


def test_heat_maps_that_are_none_or_of_no_image_are_ignored_and_it_is_said() -> None:
    taken: list[int] = []
    said: list[str] = []
    maps = MapIntake(
        lambda heat, stamp_ns: taken.append(stamp_ns), lambda key, text: said.append(text)
    )
    maps.note(100 * 10**9, 0.5)
    bad = [
        (map_message(100, 'rgb8'), 'must be mono8, 8UC1, mono16 or 32FC1'),
        (map_message(100, '32FC1'), 'must be from 0 to 1'),
        (map_message(110), 's ahead of the last image'),
        (map_message(99), 's older than the last image'),
    ]
    for count, (message, why) in enumerate(bad, start=1):
        maps.take(message, 24, 0.5)
        assert len(said) == count
        assert said[-1].startswith('a heat_map is ignored: ')
        assert why in said[-1]
    maps.take(map_message(100), 23, 0.5)
    assert (taken, maps.in_use) == ([], False)
    maps.take(map_message(100), 24, 0.5)
    assert (taken, maps.in_use) == ([100 * 10**9], True)
    said.clear()
    for second in (100, 101, 103, 104):
        maps.note(second * 10**9, 0.5)
    assert said == ['the heat maps have stopped: going on without']
    assert not maps.in_use

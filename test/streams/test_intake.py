# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gait_segmentation.geometry import Box
from gait_segmentation.results import TrackResult
from gait_segmentation.streams.config import StartConfig
from gait_segmentation.streams.intake import Intake, MapIntake, new_people, read_detections

BOX = Box(10, 10, 20, 40)
IMAGE = np.zeros((60, 80, 3), np.uint8)


class Log:
    def __init__(self, **options) -> None:
        self.events: list[object] = []
        self.intake = Intake(
            reset=lambda: self.events.append('reset'),
            initialize=self.events.append,
            warn=lambda key, text: self.events.append(f'{key}: {text}'),
            **options,
        )

    def take(self, stamp_ns: int, image: np.ndarray = IMAGE) -> list[object]:
        self.events.clear()
        self.intake.take(image, stamp_ns)
        return list(self.events)


OTHER = Box(5, 5, 20, 40)


@pytest.mark.parametrize(
    ('options', 'asked', 'boxes'),
    [
        ({}, [], [[], [], []]),
        ({'initial_box': BOX, 'initial_stamp_ns': 5}, [], [[], [BOX], []]),
        ({}, [BOX], [[BOX], [], []]),
        ({'initial_box': BOX}, [OTHER], [[OTHER], [], []]),
    ],
    ids=['none', 'initial with a stamp', 'asked for', 'both'],
)
def test_a_box_is_used_once(options: dict[str, Any], asked: list[Box], boxes: list) -> None:
    log = Log(**options)
    for box in asked:
        log.intake.request(box)
    assert [log.take(stamp) for stamp in (4, 6, 7)] == boxes


def test_when_time_begins_anew_the_initial_box_is_used_again() -> None:
    log = Log(initial_box=BOX)
    assert log.take(2_000_000_000) == [BOX]
    assert log.take(3_000_000_000) == []
    log.intake.arm()
    assert log.take(1_000_000_000) == [BOX]
    without = Log()
    without.intake.arm()
    assert without.take(1) == []


def test_another_size_resets() -> None:
    log = Log(initial_box=BOX)
    log.take(1)
    warning, reset = log.take(2, np.zeros((30, 40, 3), np.uint8))
    assert '80 x 60 to 40 x 30' in warning
    assert reset == 'reset'
    assert log.intake.shape == (30, 40)


@pytest.mark.parametrize(
    ('box', 'said'),
    [
        (Box(80, 0, 5, 5), ['outside of the image of 80 x 60']),
        (Box(-99, 0, 321, 10), ['at most 4 times', 'got x -99, y 0, 321 x 10']),
    ],
)
def test_a_box_that_makes_no_sense_is_ignored(box: Box, said: list[str]) -> None:
    log = Log()
    log.intake.request(box)
    (warning,) = log.take(1)
    assert all(text in warning for text in said)


def test_of_a_flood_of_boxes_the_newest_count() -> None:
    log = Log(slots=3)
    boxes = [Box(x % 50, 10, 20, 40 + x % 7) for x in range(20_000)]
    for box in boxes:
        log.intake.request(box)
    assert list(log.intake.requested) == boxes[-3:]
    assert log.take(1) == boxes[-3:]
    log.intake.request(BOX)
    assert log.take(2) == [BOX]


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

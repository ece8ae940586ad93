# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

from collections import deque
from typing import Any

import numpy as np
import pytest

from gait_segmentation.geometry import Box
from gait_segmentation.streams.intake import Intake

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
        log.intake.requested.append(box)
    assert [log.take(stamp) for stamp in (4, 6, 7)] == boxes


def test_when_time_begins_anew_the_initial_box_is_used_again() -> None:
    log = Log(initial_box=BOX)
    assert log.take(2_000_000_000) == [BOX]
    assert log.take(3_000_000_000) == []
    log.intake.armed = True
    assert log.take(1_000_000_000) == [BOX]
    without = Log()
    without.intake.armed = True
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
    log.intake.requested.append(box)
    (warning,) = log.take(1)
    assert all(text in warning for text in said)


def test_of_a_flood_of_boxes_the_newest_count() -> None:
    log = Log(requested=deque(maxlen=3))
    boxes = [Box(x % 50, 10, 20, 40 + x % 7) for x in range(20_000)]
    for box in boxes:
        log.intake.requested.append(box)
    assert list(log.intake.requested) == boxes[-3:]
    assert log.take(1) == boxes[-3:]
    log.intake.requested.append(BOX)
    assert log.take(2) == [BOX]

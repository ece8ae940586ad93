# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import pytest

from gait_segmentation.geometry import Box
from gait_segmentation.starting.finding.blobs import Blob
from gait_segmentation.starting.finding.candidates import Candidate, follow

PERIOD = 0.04


def blob(x: float, y: float = 20.0, width: float = 20.0, height: float = 60.0) -> Blob:
    return Blob(Box(x, y, width, height), 900, 600)


def walk(frames: int, step: float, pan: float = 0.0) -> list[Candidate]:
    """Follow one blob that moves by ``step`` against the world and ``-pan`` with the canvas."""
    candidates: list[Candidate] = []
    x = 20.0
    for number in range(frames):
        seconds = 1 + number * PERIOD
        for each in candidates:
            each.box = each.box.shifted(-pan, 0)
        candidates = follow(candidates, [blob(x)], seconds, 24, 1 + bool(candidates))
        x += step - pan
    return candidates


@pytest.mark.parametrize('pan', [0.0, 2.0])
def test_a_blob_is_followed(pan: float) -> None:
    (candidate,) = walk(20, 2.0, pan)
    assert candidate.number == 1
    assert candidate.sightings == 20


def test_two_blobs_keep_their_numbers() -> None:
    candidates: list[Candidate] = []
    for number in range(10):
        blobs = [blob(20 + 2 * number), blob(120 - 2 * number)]
        candidates = follow(candidates, blobs[:: (-1) ** number], 1 + number * PERIOD, 24, 7)
    assert [each.number for each in candidates] == [7, 8]
    assert candidates[0].speed[0] > 0 > candidates[1].speed[0]


def test_a_lost_blob_is_dropped_after_a_while() -> None:
    candidates = walk(10, 2.0)
    assert follow(candidates, [], 1 + 12 * PERIOD, 24, 2) == candidates
    assert follow(candidates, [], 1 + 20 * PERIOD, 24, 2) == []


@pytest.mark.parametrize(
    'unlikely',
    [blob(20, height=20), blob(20, width=90), Blob(Box(20, 20, 20, 60), 900, 10)],
    ids=['small', 'wide', 'still'],
)
def test_what_is_small_wide_or_still_is_not_followed(unlikely: Blob) -> None:
    assert follow([], [unlikely], 1.0, 24, 1) == []


def test_the_number_of_candidates_is_bounded() -> None:
    blobs = [blob(30 * number) for number in range(50)]
    assert len(follow([], blobs, 1.0, 24, 1)) == 24

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


def walk(frames: int, step: float, pan: float = 0.0, growth: float = 1.0) -> list[Candidate]:
    """Follow one blob that moves by ``step`` against the world and ``-pan`` with the canvas."""
    candidates: list[Candidate] = []
    x, height = 20.0, 60.0
    for number in range(frames):
        seconds, origin = 1 + number * PERIOD, (number * pan, 0.0)
        for each in candidates:
            each.box = each.box.shifted(-pan, 0)
        candidates = follow(
            candidates, [blob(x, height=height)], seconds, origin, 24, 1 + bool(candidates)
        )
        x += step - pan
        height *= growth
    return candidates


@pytest.mark.parametrize('pan', [0.0, 2.0])
def test_a_blob_is_followed_and_its_way_is_that_in_the_world(pan: float) -> None:
    (candidate,) = walk(20, 2.0, pan)
    assert candidate.number == 1
    assert candidate.sightings == 20
    # Quarter means at either end: three quarters of the way, smoothed.
    assert candidate.distance() == pytest.approx(0.75 * 38 / 60, rel=0.15)


def test_who_stays_has_come_nowhere() -> None:
    (candidate,) = walk(20, 0.0)
    assert candidate.distance() == pytest.approx(0, abs=1e-6)


def test_growing_counts_as_way() -> None:
    (candidate,) = walk(30, 0.0, growth=1.01)
    assert candidate.distance() > 0.15


def test_going_down_the_image_counts_as_way_and_legs_that_come_to_light_do_not() -> None:
    going: list[Candidate] = []
    growing: list[Candidate] = []
    for number in range(20):
        seconds = 1 + number * PERIOD
        going = follow(going, [blob(20, y=20 + 2 * number)], seconds, (0, 0), 24, 1)
        tall = 60.0 if number < 10 else 66.0
        growing = follow(growing, [blob(20, height=tall)], seconds, (0, 0), 24, 1)
    assert going[0].distance() == pytest.approx(0.75 * 38 / 60, rel=0.15)
    assert growing[0].distance() < 0.12


def test_two_blobs_keep_their_numbers() -> None:
    candidates: list[Candidate] = []
    for number in range(10):
        blobs = [blob(20 + 2 * number), blob(120 - 2 * number)]
        candidates = follow(
            candidates, blobs[:: (-1) ** number], 1 + number * PERIOD, (0, 0), 24, 7
        )
    assert [each.number for each in candidates] == [7, 8]
    assert candidates[0].speed[0] > 0 > candidates[1].speed[0]


def test_a_lost_blob_is_dropped_after_a_while() -> None:
    candidates = walk(10, 2.0)
    assert follow(candidates, [], 1 + 12 * PERIOD, (0, 0), 24, 2) == candidates
    assert follow(candidates, [], 1 + 20 * PERIOD, (0, 0), 24, 2) == []


@pytest.mark.parametrize(
    'unlikely',
    [blob(20, height=20), blob(20, width=90), Blob(Box(20, 20, 20, 60), 900, 10)],
    ids=['small', 'wide', 'still'],
)
def test_what_is_small_wide_or_still_is_not_followed(unlikely: Blob) -> None:
    assert follow([], [unlikely], 1.0, (0, 0), 24, 1) == []


def test_the_number_of_candidates_is_bounded() -> None:
    blobs = [blob(30 * number) for number in range(50)]
    assert len(follow([], blobs, 1.0, (0, 0), 24, 1)) == 24


def test_what_comes_to_touch_a_candidate_makes_it_no_broader_for_a_while() -> None:
    def followed(*, alone: bool, frames: int, side: int = 1) -> tuple[Candidate, float]:
        candidates: list[Candidate] = []
        x = 60.0
        for number in range(frames):
            x += 2
            around = Box(x, 20, 20, 60)
            if number >= 12:
                around = around.union(around.shifted(side * 24, 0))
            seen = [Blob(around, 900, 600)]
            candidates = follow(candidates, seen, 1 + number * PERIOD, (0, 0), 24, 1, alone=alone)
        return candidates[0], x + 10

    for side in (1, -1):
        candidate, center = followed(alone=True, frames=19, side=side)
        assert candidate.box.width == pytest.approx(20, abs=2)
        assert candidate.box.center_x == pytest.approx(center, abs=2)
    assert followed(alone=False, frames=19)[0].box.width > 35
    # What stays belongs to it.
    assert followed(alone=True, frames=40)[0].box.width == pytest.approx(44, abs=2)


def test_a_candidate_whose_sides_both_jump_stays_where_it_is_expected() -> None:
    candidate = walk(12, 2.0)[0]
    wide = blob(candidate.box.x - 18, width=60)
    follow([candidate], [wide], 1 + 12 * PERIOD, (0, 0), 24, 2, alone=True)
    assert candidate.box.width == pytest.approx(20, abs=1)


def test_legs_that_spread_are_followed() -> None:
    candidates: list[Candidate] = []
    for number in range(25):
        # From 0.2 to 0.4 heights and back twice a second.
        spread = 24 * abs((number / 12.5) % 1 - 0.5)
        seen = [blob(60 + 2 * number - spread / 2, width=12 + spread)]
        candidates = follow(candidates, seen, 1 + number * PERIOD, (0, 0), 24, 1, alone=True)
    assert candidates[0].free == candidates[0].seen


def test_somebody_seen_but_twice_by_a_slow_camera_may_be_broader_than_that() -> None:
    candidates: list[Candidate] = []
    for number, width in enumerate((15, 19, 40)):
        seen = [blob(60 + 4 * number, width=width)]
        candidates = follow(candidates, seen, 1 + 0.11 * number, (0, 0), 24, 1, alone=True)
    assert candidates[0].box.width > 22

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.colour import body_rows
from gait_segmentation.starting.colours import SoftColours, _alike_nearby

SHAPE = (40, 40)
FLOOR = 1e-4
WALL, COAT, PATCH = 10, 20, 30


def scene() -> tuple[np.ndarray, np.ndarray]:
    """Return bins and box: a coat before a wall, and a small patch of its own colour beside it."""
    bins = np.full(SHAPE, WALL, np.uint16)
    bins[5:35, 15:25] = COAT
    bins[18:22, 10:14] = PATCH
    inside = np.zeros(SHAPE, np.bool_)
    inside[4:36, 8:28] = True
    return bins, inside


def logit(left_out: float, radius: int = 4) -> np.ndarray:
    """Return the evidence after a first mask that holds the coat and, wrongly, the patch."""
    bins, inside = scene()
    rows = body_rows(SHAPE, (0, 0), (20.0, 20.0), 32.0)
    colours = SoftColours(bins, rows, inside, floor=FLOOR, radius=radius, left_out=left_out)
    person = (bins != WALL).astype(np.float32)
    colours.learn(person, 1 - person, 0.0)
    return colours.logit()


def test_all_kept_an_error_confirms_itself() -> None:
    assert logit(0.0)[20, 12] == pytest.approx(4)


def test_a_colour_only_seen_nearby_says_nothing() -> None:
    assert logit(1.0)[20, 12] == pytest.approx(0, abs=1e-3)


def test_what_others_confirm_stays() -> None:
    out = logit(1.0)
    assert out[20, 20] > 2
    assert out[10, 9] < -2


def test_the_outside_of_the_box_is_never_left_out() -> None:
    far, near = logit(1.0, radius=0), logit(1.0, radius=40)
    # Every pixel of the wall that may be taken off is: those outside of the box still count.
    assert far[10, 9] < -2
    assert near[10, 9] < -2
    assert near[20, 20] == pytest.approx(0, abs=1e-3)


def test_the_tables_take_off_by_band_what_was_put_in() -> None:
    bins, inside = scene()
    rows = body_rows(SHAPE, (0, 0), (20.0, 20.0), 32.0)
    colours = SoftColours(bins, rows, inside, floor=FLOOR, radius=40, left_out=1.0)
    person = (bins == PATCH).astype(np.float32)
    colours.learn(person, np.zeros(SHAPE, np.float32), 1.0)
    # The patch lies in one band: what it put in there is gone, the floor is left.
    assert colours.logit()[20, 12] == pytest.approx(0, abs=1e-3)


def test_overlap_is_zero_for_other_colours_and_one_for_the_same() -> None:
    bins, inside = scene()
    rows = body_rows(SHAPE, (0, 0), (20.0, 20.0), 32.0)
    colours = SoftColours(bins, rows, inside, floor=FLOOR, radius=1, left_out=0.5)
    person = (bins == COAT).astype(np.float32)
    colours.learn(person, 1 - person, 0.7)
    assert colours.overlap() == pytest.approx(0, abs=1e-6)
    colours.learn(person, person, 0.7)
    assert colours.overlap() == pytest.approx(1, abs=1e-5)


def test_with_other_rows_they_know_nothing_and_leave_the_first_alone() -> None:
    bins, inside = scene()
    rows = body_rows(SHAPE, (0, 0), (20.0, 20.0), 32.0)
    first = SoftColours(bins, rows, inside, floor=FLOOR, radius=4, left_out=0.5)
    person = (bins == COAT).astype(np.float32)
    first.learn(person, 1 - person, 0.7)
    before = first.logit()
    other = first.with_rows(body_rows(SHAPE, (0, 0), (20.0, 20.0), 32.0, 0.4))
    other.learn(1 - person, person, 0.7)
    assert (first.logit() == before).all()
    assert other.logit()[20, 20] < 0 < before[20, 20]


def test_learning_anew_forgets_what_was_learnt() -> None:
    bins, inside = scene()
    rows = body_rows(SHAPE, (0, 0), (20.0, 20.0), 32.0)
    used, fresh = (
        SoftColours(bins, rows, inside, floor=FLOOR, radius=4, left_out=0.5) for _ in range(2)
    )
    person = (bins == COAT).astype(np.float32)
    used.learn(1 - person, person, 0.3)
    for colours in (used, fresh):
        colours.learn(person, 1 - person, 0.7)
    assert used.logit() == pytest.approx(fresh.logit(), abs=1e-5)
    assert used.overlap() == pytest.approx(fresh.overlap(), abs=1e-6)


@pytest.mark.parametrize('radius', [1, 2, 9])
def test_all_who_are_alike_and_near_are_found(radius: int) -> None:
    rng = np.random.default_rng(6)
    bins = rng.integers(0, 2, (5, 7)).astype(np.uint16)
    inside = rng.random(bins.shape) < 0.7
    first, places = _alike_nearby(bins, inside, radius)
    for pixel, (row, col) in enumerate(np.ndindex(5, 7)):
        expected = [
            7 * r + c
            for r, c in np.ndindex(5, 7)
            if max(abs(r - row), abs(c - col)) <= radius
            and inside[row, col]
            and inside[r, c]
            and bins[r, c] == bins[row, col]
        ]
        assert places[first[pixel] : first[pixel + 1]].tolist() == expected

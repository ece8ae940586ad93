# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""People without a slot, and what may be taken for them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from gait_segmentation.results import TrackResult
from gait_segmentation.tracking.target import Target
from test.tracking.figures import BLUE, Figure, Told, picture

OWN = Figure(110)


def distractors(told: Told) -> list[Target]:
    return [each for found in told.tracker._distractors.values() for each in found]


def passed(told: Told, xs: Sequence[float]) -> tuple[TrackResult, np.ndarray]:
    """Let somebody walk by behind who is tracked; return the last result and their mask."""
    told.start(OWN)
    told.show(OWN)
    for x in xs:
        image, (theirs, mine) = picture((Figure(float(x), BLUE), OWN))
        result = told.see(image, [mine])[0]
    return result, theirs


def test_who_comes_near_is_followed_and_keeps_their_pixels() -> None:
    told = Told()
    xs = np.arange(215.0, 145.0, -4.0)
    result, theirs = passed(told, xs)
    (other,) = distractors(told)
    scale = other.world.scale
    assert other.person.center_x / scale == pytest.approx(xs[-1], abs=8)
    assert other.person.velocity[0] / scale == pytest.approx(-100, abs=30)
    assert (result.likelihood[theirs > 0] > 127).mean() < 0.05
    assert result.likelihood[OWN.mask() > 0].mean() > 180
    (target,) = told.tracker._targets()
    assert target.accompanied


def test_who_is_gone_is_forgotten() -> None:
    told = Told()
    passed(told, np.arange(215.0, 150.0, -4.0))
    assert distractors(told)
    for _ in range(40):
        told.show(OWN)
    assert not distractors(told)


def test_who_gets_a_slot_is_no_distractor() -> None:
    told = Told(slots=2)
    passed(told, np.arange(215.0, 150.0, -4.0))
    other = Figure(150, BLUE)
    told.start(other)
    told.show(OWN, other)
    told.show(OWN, other)
    assert [target.track_id for target in told.tracker._targets()] == [1, 2]
    assert not distractors(told)


def test_nobody_is_found_beside_who_walks_alone() -> None:
    told = Told()
    told.start(OWN)
    for number in range(30):
        told.show(replace(OWN, x=OWN.x + 2.5 * number))
        assert not distractors(told)


def test_what_is_beside_half_a_person_may_be_the_other_half() -> None:
    """As beyond a pole."""
    told = Told()
    told.start(Figure(60))
    for number in range(40):
        told.show(Figure(60 + 2.0 * number), boards=[(100, 118)])
        assert not distractors(told)

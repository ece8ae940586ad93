# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from gait_segmentation.scene.scene import ShownHeat
from gait_segmentation.tracking import TrackingConfig
from gait_segmentation.tracking.cues import CueInput
from gait_segmentation.tracking.cues.heat_map import HeatMapCue
from gait_segmentation.tracking.state import State

SHAPE = (120, 200)
WINDOW = (slice(10, 110), slice(30, 190))
HEIGHT = 72.0


def body(dx: int = 0, dy: int = 0, legs: int = 0) -> np.ndarray:
    """Return somebody of 72 pixels: a head, a trunk, and a leg put forward, or more."""
    mask = np.zeros(SHAPE, np.uint8)
    for top, bottom, left, right in ((24, 36, 74, 86), (36, 66, 70, 90), (66, 96, 66, 78)):
        mask[top + dy : bottom + dy, left + dx : right + dx] = 255
    mask[66 + dy : 96 + dy, 84 + dx + legs : 96 + dx + legs] = 255
    return mask


def seen(mask: np.ndarray) -> SimpleNamespace:
    """Return a frame of a person who is as bright as the place is dark."""
    noise = np.random.default_rng(5).integers(0, 120, SHAPE, np.uint8)
    gray = cv2.GaussianBlur(np.where(mask > 0, 130 + noise, noise // 2), (3, 3), 0)
    return SimpleNamespace(image=SimpleNamespace(gray=gray))


PERSON, OTHER = body() > 0, body(80) > 0


def evidence(
    heat: np.ndarray | None,
    trust: float = 1.0,
    age: int = 0,
    moved: tuple[int, int] = (0, 0),
    legs: int = 0,
) -> np.ndarray | None:
    """
    Return what a map, so many frames old, says of somebody in the image.

    They moved since, and their legs beside that.
    """
    then, frame = seen(body()), seen(body(*moved, legs))
    shown = None if heat is None else ShownHeat(heat, age, trust)
    states = [State(then, (0.0, 0.0))] * age + [State(frame, moved)]
    expected = body(*moved)[WINDOW]
    logit = np.where(expected > 0, 1, -1).astype(np.float32)
    area = np.count_nonzero(PERSON) / HEIGHT**2
    given = CueInput(
        SimpleNamespace(now=frame, heat=shown),
        states,
        SimpleNamespace(height=HEIGHT),
        WINDOW,
        expected,
        logit,
        True,
        area,
        TrackingConfig(),
    )
    found = HeatMapCue().evidence(given)
    if found is None:
        return None
    whole = np.full(SHAPE, np.nan, np.float32)
    whole[WINDOW] = found.logit
    return whole


def test_a_map_says_yes_and_no_as_far_as_it_is_trusted():
    found, half = evidence(body()), evidence(body(), 0.5)
    assert (found[PERSON] > 3).all()
    assert np.nanmax(found[~PERSON]) < -3
    np.testing.assert_allclose(half, found / 2, rtol=1e-5)
    unsure = evidence(np.where(PERSON, np.uint8(180), np.uint8(60)))
    assert 0 < unsure[PERSON].min() < 2
    assert -2 < np.nanmin(unsure) < 0


@pytest.mark.parametrize('given', [(None, 1.0), (body(), 0.0)])
def test_without_a_map_that_is_trusted_nothing_is_said(given):
    assert evidence(*given) is None


def test_the_regions_of_other_people_count_against():
    found = evidence(body() | body(80))
    assert (found[PERSON] > 3).all()
    assert (found[OTHER] < -3).all()


@pytest.mark.parametrize(('rows', 'shown'), [(0, 0), (36, 1), (61, 1)])
def test_a_map_that_misses_half_of_the_person_only_says_yes(rows, shown):
    heat = body()
    heat[rows:] = 0
    found = evidence(heat)
    assert np.nanmin(found) == 0
    assert (found[heat > 0] > 3).all()
    assert (np.nanmax(found) > 0) == shown


def test_a_map_that_misses_half_of_the_person_says_nothing_of_what_is_away_from_them():
    heat = body()
    heat[36:] = 0
    # At the head, from there on farther than an arm reaches.
    heat[28:32, 86:180] = 255
    found = evidence(heat)
    assert (found[28:32, 74:86] > 3).all()
    assert np.abs(found[28:32, 150:180]).max() < 0.2


def test_of_people_who_hang_together_only_what_is_where_the_person_is_expected_is_theirs():
    together = body() | body(80)
    together[45:50, 80:160] = 255
    found = evidence(together)
    assert (found[PERSON] > 1).all()
    # The more others there are in the window, the less it tells.
    assert (found[PERSON] < 2.5).all()
    assert np.abs(found[OTHER]).max() < 0.2
    # An arm as long that makes no second person is.
    arm = body()
    arm[45:50, 80:130] = 255
    assert (evidence(arm)[arm > 0] > 3).all()


def test_an_old_map_is_carried_along_and_softened():
    moved = (30, 6)
    found, there = evidence(body(), age=3, moved=moved), body(*moved) > 0
    assert found[there].mean() > 1
    assert found[PERSON & ~there].mean() < -1
    fresh = evidence(body(*moved), moved=moved)
    # On either side of where the trunk ends.
    edge = np.s_[52:62, 119:121]
    assert np.abs(found[edge]).max() < 1
    assert np.abs(fresh[edge]).min() > 3


def test_a_leg_is_where_it_has_gone_since_an_old_map_was_made():
    there = body(legs=4) > 0
    found = evidence(body(), age=1, legs=4)
    front, back = there & ~PERSON, PERSON & ~there
    assert found[front].mean() > 0.5
    assert found[back].mean() < -0.5

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.geometry import Box
from gait_segmentation.starting.first_scene import (
    FirstScene,
    barrier_distance,
    barrier_logit,
    first_scene,
)

BOX = Box(20, 10, 40, 100)


def scene() -> FirstScene:
    """Return a window with somebody dark in the left half of the box, before something light."""
    lab = np.full((120, 80, 3), 200, np.uint8)
    lab[10:110, 20:40] = 60
    return first_scene(lab, BOX, None)


def test_colours_decide_by_what_they_were_learnt_from() -> None:
    found = scene()
    person = np.zeros(found.shape, np.float32)
    person[30:90, 25:35] = 1
    logit = found.logit(person, 1 - person, 0.3)
    assert logit[50, 22] > 0 > logit[50, 50]
    assert np.abs(logit).max() <= 4
    swapped = found.logit(1 - person, person, 0.3)
    assert swapped == pytest.approx(-logit), 'what was learnt before is forgotten'


def test_a_mask_that_touches_all_sides_of_the_box_has_no_gap() -> None:
    found = scene()
    labels = np.zeros(found.shape, np.bool_)
    assert found.gap(labels) == 1
    labels[11:110, 20:59] = True
    assert found.gap(labels) == 0, 'within what a given box may be off'
    labels[:, 40:] = False
    assert found.gap(labels) == pytest.approx(0.5 - 0.03)
    labels[:60] = False
    assert found.gap(labels) == pytest.approx(1 - 2 * 0.03)


def striped() -> tuple[np.ndarray, np.ndarray]:
    """Return a wall with a stripe that runs into the box, a person in it, and the box."""
    image = np.full((60, 80, 3), 100, np.uint8)
    image[30:34] = 160
    image[10:50, 35:45] = (60, 140, 120)
    inside = np.zeros((60, 80), np.bool_)
    inside[8:52, 30:50] = True
    return image, inside


def test_what_runs_into_the_box_is_near_and_the_person_is_far() -> None:
    image, inside = striped()
    distance = barrier_distance(image, inside)
    assert distance[20, 31] == 0
    assert distance[31, 32] == 0
    assert distance[25, 40] == 40 + 40 + 20
    assert not distance[~inside].any()


def test_the_distance_is_the_least_range_over_paths() -> None:
    # One channel, one row: the way from the left climbs to 90, that from the right to 50.
    image = np.repeat(np.array([[10, 90, 40, 50, 10]], np.uint8)[:, :, None], 3, axis=2)
    inside = np.array([[False, True, True, True, False]])
    assert barrier_distance(image, inside)[0].tolist() == [0, 240, 120, 120, 0]


def test_the_evidence_is_signed_limited_and_only_inside() -> None:
    image, inside = striped()
    logit = barrier_logit(image, inside)
    assert logit[25, 40] == pytest.approx(2)
    assert logit[20, 32] == pytest.approx(-2)
    assert not logit[~inside].any()


@pytest.mark.parametrize('value', [True, False])
def test_a_box_that_is_everything_or_nothing_says_nothing(value: bool) -> None:
    image, _ = striped()
    assert not barrier_logit(image, np.full((60, 80), value)).any()

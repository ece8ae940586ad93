# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.starting.barrier import barrier_distance, barrier_logit


def scene() -> tuple[np.ndarray, np.ndarray]:
    """Return a wall with a stripe that runs into the box, a person in it, and the box."""
    image = np.full((60, 80, 3), 100, np.uint8)
    image[30:34] = 160
    image[10:50, 35:45] = (60, 140, 120)
    inside = np.zeros((60, 80), np.bool_)
    inside[8:52, 30:50] = True
    return image, inside


def test_what_runs_into_the_box_is_near_and_the_person_is_far() -> None:
    image, inside = scene()
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
    image, inside = scene()
    logit = barrier_logit(image, inside)
    assert logit[25, 40] == pytest.approx(2)
    assert logit[20, 32] == pytest.approx(-2)
    assert not logit[~inside].any()


@pytest.mark.parametrize('value', [True, False])
def test_a_box_that_is_everything_or_nothing_says_nothing(value: bool) -> None:
    image, _ = scene()
    assert not barrier_logit(image, np.full((60, 80), value)).any()

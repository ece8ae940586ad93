# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import pytest

from gait_segmentation.detector.person_detector import Detection
from gait_segmentation.geometry import Box
from gait_segmentation.starting.sightings import Sightings

BOX, OTHER = Box(10, 10, 40, 100), Box(200, 30, 30, 80)


def seen(seconds, *people):
    return round(seconds * 1e9), tuple(Detection(box, score) for box, score in people)


def test_who_is_seen_for_certain_is_found_at_once_the_tallest_first():
    assert Sightings().update(*seen(1, (OTHER, 0.9), (BOX, 0.7)), [], 20) == [BOX, OTHER]


@pytest.mark.parametrize(
    ('score', 'seconds', 'box', 'found'),
    [
        (0.5, 1.4, BOX, True),
        (0.5, 2.5, BOX, False),
        (0.5, 1.4, BOX.shifted(60, 0), False),
        (0.4, 1.4, BOX.shifted(3, 3), False),
        (0.4, 1.4, BOX.shifted(8, 8), True),
        (0.2, 1.4, BOX.shifted(8, 8), False),
    ],
)
def test_who_is_not_so_certain_must_be_seen_again_or_move(score, seconds, box, found):
    sightings = Sightings()
    assert sightings.update(*seen(1, (BOX, score)), [], 20) == []
    # What does not move is compared with where it was first.
    for _ in range(2):
        assert sightings.update(*seen(1.2, (BOX, min(score, 0.4))), [], 20) == []
    assert sightings.update(*seen(seconds, (box, score)), [], 20) == ([box] if found else [])


def test_nobody_is_found_who_is_tracked_small_or_hardly_like_a_person():
    sightings = Sightings()
    for _ in range(3):
        people = seen(1, (BOX, 0.9), (OTHER, 0.9), (BOX.shifted(300, 0), 0.2))
        assert sightings.update(*people, [BOX.shifted(3, 3)], 90) == []

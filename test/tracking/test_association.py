# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from unittest.mock import Mock

import pytest

from gait_segmentation.detector.detection import Detection, associate
from gait_segmentation.detector.sources import Seen
from gait_segmentation.geometry import Box
from gait_segmentation.tracking.association import associate_beside, explain, unexplained

OWN, OTHER = Box(50, 50, 40, 100), Box(150, 50, 40, 100)


def detected(*boxes: Box) -> list[Detection]:
    return [Detection(box, 0.9) for box in boxes]


def test_each_detection_is_of_one_track_and_the_best_pair_comes_first() -> None:
    here, there = OWN.shifted(4, -2), OTHER.shifted(4, -2)
    assert associate([[OWN], [OTHER]], detected(there, here)) == {0: 1, 1: 0}
    # Two tracks, one of which is hidden.
    assert associate([[OWN.shifted(9, 0)], [OWN]], detected(here)) == {1: 0}
    # The second best, if the best is of another.
    assert associate([[OWN], [OWN.shifted(20, 0)]], detected(OWN, OWN.shifted(-8, 0))) == {0: 0}
    assert associate([[OWN]], detected(OTHER)) == associate([[OWN]], []) == associate([], []) == {}


def test_a_track_may_be_where_it_was_seen_or_where_its_body_is() -> None:
    assert associate([[OTHER, OWN]], detected(OWN)) == {0: 0}


def test_who_comes_out_behind_somebody_is_not_taken_for_them() -> None:
    # The one in front has taken pixels of the other along, so both boxes are about both of them.
    front, behind = Box(130, 70, 47, 138), Box(129, 91, 34, 110)
    two = detected(Box(128, 84, 41, 118), Box(144, 64, 41, 135))
    assert associate([[front]], two) == {0: 0}
    assert associate_beside([[behind]], [[front]], two) == {0: 1}
    # While only one is seen, that is who is not hidden, however well it suits the other.
    assert associate_beside([[behind]], [[front]], two[:1]) == {0: 0}
    assert associate_beside([[behind]], [], two) == {}


@pytest.mark.parametrize(
    ('beside', 'new'),
    [
        (OWN.shifted(24, 0), True),
        (Box(52, 50, 36, 50), False),
        (OTHER, True),
    ],
    ids=['somebody who touches them', 'the upper half', 'apart'],
)
def test_who_touches_somebody_is_another_one_but_no_part_is(beside: Box, new: bool) -> None:
    seen = detected(OWN, beside)
    pairs = associate([[OWN]], seen)
    assert pairs == {0: 0}
    assert unexplained(seen, pairs, [[OWN]]) == seen[1:] * new


def test_a_part_of_somebody_who_was_not_detected_is_nobody_else() -> None:
    part = detected(Box(50, 50, 40, 25))
    assert unexplained(part, {}, [[OWN]]) == []
    assert unexplained(part, {}, [[OTHER]]) == part


def test_of_who_was_detected_only_the_detection_counts_for_who_is_beside() -> None:
    # They had taken somebody for a part of them.
    wide, left, right = Box(0, 0, 100, 100), Box(0, 0, 60, 100), Box(60, 0, 40, 100)
    seen = detected(left, right)
    assert unexplained(seen, {0: 0}, [[wide]]) == seen[1:]
    assert unexplained(seen[1:], {}, [[wide]]) == []


@pytest.mark.parametrize(('score', 'resumed'), [(0.7, 1), (0.5, 0)])
def test_who_is_lost_is_seen_where_they_are_expected_if_it_is_sure(score, resumed) -> None:
    lost = Mock(state='lost', boxes_at=lambda stamp_ns: (OWN,))
    assert explain([lost], Seen(5, (Detection(OWN, score),))) == [Detection(OWN, score)]
    explain([lost], Seen(5, (Detection(OTHER, score),)))
    assert lost.resume.call_count == resumed


def test_who_is_lost_is_not_seen_where_somebody_else_is_who_is_followed() -> None:
    tracked = Mock(state='tracked', boxes_at=lambda _: (OWN,), detected_in=lambda _: OWN)
    lost = Mock(state='lost', boxes_at=lambda _: (OWN.shifted(3, 0),))
    explain([tracked, lost], Seen(5, (Detection(OWN, 0.9),)))
    tracked.see.assert_called_once()
    lost.resume.assert_not_called()


def test_a_detection_is_of_whom_it_fits_not_of_who_was_seen_there_last() -> None:
    beside = OWN.shifted(25, 0)
    track = Mock(state='tracked', boxes_at=lambda _: (OWN,), detected_in=lambda _: beside)
    seen = detected(beside, OWN.shifted(2, 0))
    assert explain([track], Seen(5, tuple(seen))) == seen[:1]
    track.see.assert_called_once_with(seen[1], 5)


def test_who_was_drawn_away_is_given_the_detection_where_they_were_seen_last() -> None:
    track = Mock(state='tracked', boxes_at=lambda _: (OWN,), detected_in=lambda _: OTHER)
    seen = detected(OTHER.shifted(2, 0))
    assert explain([track], Seen(5, tuple(seen))) == []
    track.see.assert_called_once_with(seen[0], 5)

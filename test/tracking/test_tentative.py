# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from gait_segmentation.detector.detection import Detection, SoftMask
from gait_segmentation.geometry import Box
from gait_segmentation.tracking.existence import Existence
from gait_segmentation.tracking.tentative import Tentative, follow

BOX, S = Box(10, 10, 40, 100), 10**9


def rests(box: Box) -> bool:
    return False


def seen(*boxes: Box, score: float = 0.5) -> list[Detection]:
    return [Detection(box, score) for box in boxes]


def test_each_detection_goes_on_with_who_was_there_or_begins() -> None:
    (first,), none = follow([], seen(BOX), S, 320, rests)
    assert none == []
    found, others = follow(
        [first], seen(BOX.shifted(3, 0), BOX.shifted(200, 0)), 2 * S, 320, rests
    )
    assert others == []
    assert [each.existence.sightings for each in found] == [2, 1]
    assert [each.stamp_ns for each in found] == [2 * S, 2 * S]
    assert follow([first], [], 2 * S, 320, rests) == ([], [first])


def test_who_moves_against_the_world_has_moved_from_the_first_sight_on() -> None:
    beside = BOX.shifted(200, 0)
    each, other = follow([], seen(BOX, beside), S, 320, BOX.__eq__)[0]
    assert (each.existence.moved_ns, other.existence.moved_ns) == (S, None)
    both, _ = follow([each, other], seen(BOX, beside), 2 * S, 320, beside.__eq__)
    assert [each.existence.moved_ns for each in both] == [S, 2 * S]


def test_who_is_not_seen_any_more_is_forgotten_and_what_was_no_person_later() -> None:
    (each,), _ = follow([], seen(BOX), S, 320, rests)
    thing = replace(each, rejected=True)
    assert [each.is_over(S + s * S // 2) for s in (2, 3)] == [False, True]
    assert [thing.is_over(S + s * S) for s in (29, 31)] == [False, True]


def test_what_was_no_person_is_not_looked_for() -> None:
    track = SimpleNamespace(detected_in=lambda _: BOX, existence=Existence(S).seen(0.9, 0.4))
    thing = Tentative.rejected_of(track, S)
    assert not thing.may_be(S)
    assert not thing.is_over(S + 20 * S)
    assert Tentative(thing.detection, S, thing.existence).may_be(S)


def test_who_was_compared_is_compared_again_after_a_while() -> None:
    (each,), _ = follow([], seen(BOX), S, 320, rests)
    assert not each.was_compared(S)
    compared = replace(each, compared_ns=S)
    assert [compared.was_compared(S + s * S // 4) for s in (1, 3)] == [True, False]


def drawn(each: Tentative, presence: float, box: Box = BOX) -> Tentative:
    return each.drawn(
        box, SoftMask(np.zeros((2, 2), np.uint8), 1.0, (0, 0), box, presence), S, 320
    )


def test_a_faint_mask_speaks_against_somebody_tall_only() -> None:
    (each,), _ = follow([], seen(BOX), S, 320, rests)
    small, tall = (drawn(each, 0.0, box).existence for box in (Box(10, 10, 16, 40), BOX))
    assert tall.log_odds(S) < each.existence.log_odds(S) < small.log_odds(S)


@pytest.mark.parametrize(
    ('score', 'by_map', 'moves', 'is_drawn'),
    [
        (0.5, False, False, True),
        (0.38, False, False, False),
        (0.38, False, True, True),
        (0.5, True, False, False),
    ],
)
def test_who_is_seen_clearly_or_begins_is_drawn_if_no_map_shows_them(
    score, by_map, moves, is_drawn
):
    detection = Detection(Box(10, 10, 16, 40), score, by_map=by_map)
    (each,), _ = follow([], [detection], S, 320, lambda box: moves)
    assert each.is_to_be_drawn(S) == is_drawn


def test_what_is_hardly_a_person_is_drawn_more_rarely() -> None:
    (each,), _ = follow([], seen(BOX), S, 320, rests)
    person, thing = drawn(each, 5.0), drawn(each, -20.0)
    assert thing.existence.log_odds(S) < -5 < each.existence.log_odds(S)
    assert each.existence.log_odds(S) < 0 < person.existence.log_odds(S)
    assert [person.is_to_be_drawn(S + s * S // 4) for s in (1, 3)] == [True, True]
    assert [thing.is_to_be_drawn(S + s * S // 4) for s in (1, 3)] == [False, True]

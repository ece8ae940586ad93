# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from gait_segmentation.geometry import Box
from gait_segmentation.tracking import people
from gait_segmentation.tracking.group import own_feedback
from gait_segmentation.tracking.track import Track
from test.tracking.figures import BLUE, GREEN, RED, STEP_NS, Figure, Told, picture, watched

STAYS = Figure(120)


def beside(told: Told) -> list[Track]:
    """Return who is followed without a slot."""
    return [track for track in told.tracker._people.tracks if track.slot is None]


def taken(told: Told, *others: Figure, shown: bool = True) -> float:
    """Show others behind somebody who stays, in the map, too; return the share taken of them."""
    image, (*theirs, own) = picture([*others, STAYS])
    if shown:
        told.tracker.add_heat_map(np.maximum.reduce([*theirs, own]), told.stamp_ns)
    result, *_ = told.see(image, [own])
    there = np.maximum.reduce([np.zeros_like(own), *theirs]) > 0
    return float((result.likelihood[there] > 127).mean()) if there.any() else 0.0


def started() -> Told:
    told = Told()
    told.start(STAYS)
    return told


@pytest.mark.parametrize('coat', [RED, BLUE, GREEN], ids=['the same', 'blue', 'green'])
def test_who_passes_takes_their_own_pixels_along_whatever_they_wear(coat) -> None:
    told = started()
    shares = [taken(told, Figure(x, coat, y=86)) for x in range(230, 20, -5)]
    assert np.mean(shares) < 0.1


def test_they_are_followed_while_they_are_near_and_the_map_shows_them() -> None:
    told = started()
    taken(told)
    assert beside(told) == []
    taken(told, Figure(185, BLUE))
    [first] = beside(told)
    for x in range(210, 480, 6):
        taken(told, Figure(x, BLUE))
        assert len(beside(told)) <= 1
    assert beside(told) == [], 'gone'
    for _ in range(3):
        taken(told, Figure(185, BLUE))
    [second] = beside(told)
    assert second is not first
    for _ in range(6):
        image, (_, own) = picture([Figure(185, BLUE), STAYS])
        told.tracker.add_heat_map(own, told.stamp_ns)
        told.see(image, [own])
    assert beside(told) == [], 'not shown'


def test_whom_a_map_shows_in_a_box_that_is_given_is_no_bystander() -> None:
    told = Told()
    told.start(STAYS)
    for _ in range(3):
        taken(told)
        assert beside(told) == []


def test_there_are_none_without_a_map_and_at_most_so_many(monkeypatch) -> None:
    crowd = [Figure(x, BLUE, height=60.0) for x in (40, 75, 165, 200)]
    told = started()
    for _ in range(3):
        taken(told, *crowd, shown=False)
    assert beside(told) == []
    monkeypatch.setattr(people, '_MOST_BESIDE', 2)
    for _ in range(3):
        taken(told, *crowd)
    assert len(beside(told)) == 2


def test_a_bystander_who_gets_a_slot_is_no_bystander_any_more() -> None:
    told = Told(slots=2)
    told.start(STAYS)
    other = Figure(185, BLUE)
    for number in range(3):
        image, (theirs, own) = picture([other, STAYS])
        told.tracker.add_heat_map(np.maximum(theirs, own), told.stamp_ns)
        if number == 2:
            told.start(other)
        results = told.see(image, [own, theirs])
        assert len(beside(told)) == (number == 1)
    assert [result.track_id for result in results] == [1, 3]


def test_a_map_that_misses_who_has_a_slot_does_not_tell_who_is_beside() -> None:
    told = started()
    for _ in range(3):
        image, (theirs, own) = picture([Figure(185, BLUE), STAYS])
        told.tracker.add_heat_map(theirs, told.stamp_ns)
        told.see(image, [own])
        assert beside(told) == []


def test_a_map_of_something_else_shows_nobody_beside() -> None:
    told = started()
    for _ in range(3):
        image, (theirs, own) = picture([Figure(185, BLUE), STAYS])
        told.tracker.add_heat_map(np.roll(theirs | own, (9, 14), (0, 1)), told.stamp_ns)
        told.see(image, [own])
    assert beside(told) == []


def test_who_is_beside_counts_as_hidden_and_for_themselves_only_if_they_were_outlined() -> None:
    mapped, seen = started(), Watched()
    taken(mapped)
    taken(mapped, Figure(185, BLUE))
    for _ in range(2):
        seen.taken(Figure(185, BLUE))
    for other, vague in (beside(mapped), False), (seen.tracks, True):
        [claim] = [track.claim() for track in other]
        assert (claim.hidden, claim.vague) == (True, vague)
    [stays] = mapped.tracker.tracks()
    assert (stays.claim().hidden, stays.claim().vague) == (False, False)


def test_whom_a_detector_sees_beside_need_not_be_shown_by_a_map() -> None:
    seen = Watched()
    for _ in range(4):
        _, (own,) = picture([STAYS])
        seen.told.tracker.add_heat_map(own, seen.told.stamp_ns)
        seen.taken(Figure(185, BLUE))
    [other] = seen.tracks
    assert other.existence.missed == 0


def test_of_who_is_beside_nothing_is_learnt_while_they_meet_who_has_a_slot() -> None:
    seen = Watched()
    for x, kept in (185, False), (185, True), (175, True), (150, True), (135, False):
        seen.taken(Figure(x, BLUE, y=86))
        found = [own_feedback(track, seen.told.stamp_ns - STEP_NS) for track in seen.tracks]
        assert [each is not None for each in found] == [kept] * len(seen.tracks), x
        assert seen.tracks or not kept


class Watched:
    """Somebody who stays, and a detector that looks at every frame and sees all boxes."""

    def __init__(self, slots: int = 1, *, given: bool = True, **tracking) -> None:
        self.boxes: list[Box] = []
        self.told = watched(self.boxes, slots, **tracking)
        if given:
            self.told.start(STAYS)

    @property
    def tracks(self) -> list[Track]:
        return beside(self.told)

    def taken(self, *others: Figure, seen: bool = True) -> float:
        """Show others behind who stays; return the share that is taken of them."""
        self.boxes[:] = [figure.box for figure in (*others, STAYS) if seen]
        return taken(self.told, *others, shown=False)


@pytest.mark.parametrize('coat', [RED, BLUE, GREEN], ids=['the same', 'blue', 'green'])
def test_who_is_seen_by_the_detector_takes_their_own_pixels_along_whatever_they_wear(coat) -> None:
    path = [Figure(x, coat, y=86) for x in range(230, 20, -5)]
    shares = {}
    # Another coat is not taken in any case.
    for follows in (True, False) if coat == RED else (True,):
        seen = Watched(use_bystanders=follows)
        shares[follows] = np.mean([seen.taken(each) for each in path])
    assert shares[True] < 0.1
    assert coat != RED or shares[False] > 2 * shares[True]


def test_whom_the_detector_sees_is_followed_once_while_it_does_and_they_are_near() -> None:
    seen = Watched()
    seen.taken()
    assert seen.tracks == [], 'of who has a slot'
    for _ in range(3):
        seen.taken(Figure(185, BLUE))
        assert len(seen.tracks) == 1
    for _ in range(60):
        seen.taken(Figure(185, BLUE), seen=False)
    assert seen.tracks == []
    for _ in range(3):
        seen.taken(Figure(300, BLUE, y=140, height=25))
    assert seen.tracks == [], 'far behind'


def test_a_bystander_gets_a_slot_that_is_free() -> None:
    seen = Watched(slots=2, given=False)
    first, second = Figure(55, GREEN, height=95), Figure(185, BLUE, height=90)
    for _ in range(3):
        seen.taken(first, second)
    [other] = seen.tracks
    assert other.body.iou(second.box) > 0.5
    seen.told.tracker._people.free(1)
    for _ in range(3):
        seen.taken(second)
    bodies = [track.body for track in seen.told.tracker.tracks()]
    assert [body.iou(second.box) > 0.5 for body in bodies] == [False, True]
    assert seen.tracks == []

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from gait_segmentation.tracking import bystanders
from test.tracking.figures import BLUE, GREEN, RED, Figure, Told, picture

STAYS = Figure(120)


def taken(told: Told, *others: Figure, shown: bool = True) -> float:
    """Show others behind somebody who stays, in the map, too; return the share taken of them."""
    image, (*theirs, own) = picture([*others, STAYS])
    if shown:
        told.tracker.add_heat_map(np.maximum.reduce([*theirs, own]), told.stamp_ns)
    [result] = told.see(image, [own])
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
    group = told.tracker._slots.bystanders
    taken(told)
    assert group.tracks == []
    taken(told, Figure(210, BLUE))
    [first] = group.tracks
    for x in range(210, 480, 6):
        taken(told, Figure(x, BLUE))
        assert len(group.tracks) <= 1
    assert group.tracks == [], 'gone'
    for _ in range(3):
        taken(told, Figure(210, BLUE))
    [second] = group.tracks
    assert second is not first
    for _ in range(6):
        image, (_, own) = picture([Figure(210, BLUE), STAYS])
        told.tracker.add_heat_map(own, told.stamp_ns)
        told.see(image, [own])
    assert group.tracks == [], 'not shown'


def test_there_are_none_without_a_map_and_at_most_so_many(monkeypatch) -> None:
    crowd = [Figure(x, BLUE, height=60.0) for x in (40, 75, 165, 200)]
    told = started()
    for _ in range(3):
        taken(told, *crowd, shown=False)
    assert told.tracker._slots.bystanders.tracks == []
    monkeypatch.setattr(bystanders, 'MOST', 2)
    for _ in range(3):
        taken(told, *crowd)
    assert len(told.tracker._slots.bystanders.tracks) == 2


def test_a_bystander_who_gets_a_slot_is_no_bystander_any_more() -> None:
    told = Told(slots=2)
    told.start(STAYS)
    other = Figure(210, BLUE)
    for number in range(3):
        image, (theirs, own) = picture([other, STAYS])
        told.tracker.add_heat_map(np.maximum(theirs, own), told.stamp_ns)
        if number == 2:
            told.start(other)
        results = told.see(image, [own, theirs])
        assert len(told.tracker._slots.bystanders.tracks) == (number < 2)
    assert [result.track_id for result in results] == [1, 2]


def test_a_map_of_something_else_shows_nobody_beside() -> None:
    told = started()
    for _ in range(3):
        image, (theirs, own) = picture([Figure(210, BLUE), STAYS])
        told.tracker.add_heat_map(np.roll(theirs | own, (9, 14), (0, 1)), told.stamp_ns)
        told.see(image, [own])
    assert told.tracker._slots.bystanders.tracks == []

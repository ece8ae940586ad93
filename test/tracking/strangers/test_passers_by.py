# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What people without a slot do to somebody tracked."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gait_segmentation.tracking.strangers.passers_by import PassersBy
from test.tracking.figures import BLUE, RED, Figure, Told, picture

FRAMES = 36
OWN = Figure(110)


def meeting(number: int, coat: tuple[int, int, int] = BLUE) -> tuple[Figure, Figure]:
    """Return somebody tracked, and somebody else who comes to meet them."""
    own = replace(OWN, x=110 + 2.0 * number)
    return own, Figure(215 - 2.5 * number, coat)


def known(told: Told) -> PassersBy:
    (world,) = {target.world for target in told.tracker._targets()}
    return world.passers_by


@pytest.mark.parametrize('front', [False, True], ids=['behind', 'in front'])
def test_somebody_without_a_slot_is_not_taken_for_who_is_tracked(front: bool) -> None:
    told = Told()
    told.start(OWN)
    met = 0
    for number in range(FRAMES):
        own, other = meeting(number)
        image, masks = picture((own, other) if front else (other, own))
        mine, theirs = masks if front else masks[::-1]
        (result,) = told.see(image, [mine])
        assert result.state == 'tracked'
        hidden = (own.mask() > 0).sum() > 1.2 * (mine > 0).sum()
        likely = result.likelihood
        near = np.abs(np.arange(likely.shape[1]) - own.x) < 50
        seen = (theirs > 0) & near
        if number > 11 and seen.sum() > 600:
            assert (likely[seen] > 127).mean() < 0.5
            met += 1
        if not hidden:
            assert likely[mine > 0].mean() > 150
    assert met > 15


@pytest.mark.parametrize('speed', [3.0, 4.0])
def test_masks_of_two_do_not_turn_anybody_round(speed: float) -> None:
    told = Told()
    own = Figure(60)
    told.start(own)
    other = Figure(60 + 36 * speed)
    for _ in range(18):
        image, masks = picture((own, other))
        joined = abs(own.x - other.x) < 40
        (result,) = told.see(image, [masks[0] | masks[1] if joined else masks[0]])
        assert result.box is not None
        assert abs(result.body.center_x - own.x) < 5
        own, other = replace(own, x=own.x + speed), replace(other, x=other.x - speed)


def test_somebody_is_known_from_coming_near_until_gone() -> None:
    told = Told()
    told.start(OWN)
    counts = []
    for number in range(66):
        own, other = meeting(number)
        image, masks = picture((other, own))
        told.see(image, [masks[1]])
        counts.append(len(known(told).known))
    assert counts[0] == 0
    assert 1 in counts
    assert counts[-1] == 0


def test_nobody_is_known_of_somebody_who_walks_alone() -> None:
    told = Told()
    told.start(OWN)
    for number in range(30):
        told.show(meeting(number)[0])
        assert not known(told).known


def test_a_bag_swung_off_the_mask_is_nobody() -> None:
    told = Told()
    told.start(OWN)
    for number in range(30):
        own, _ = meeting(number)
        image, masks = picture((own,))
        x, y = round(own.x) + 22, 100
        image[y : y + 14, x : x + 14] = RED
        told.see(image, masks)
        assert not known(told).known


def test_who_gets_a_slot_passes_by_no_more() -> None:
    told = Told(slots=2)
    told.start(OWN)
    for number in range(12):
        own, other = meeting(number)
        image, masks = picture((other, own))
        told.see(image, [masks[1]])
    (passing,) = known(told).known
    own, other = meeting(12)
    told.start(other)
    image, masks = picture((other, own))
    told.see(image, masks[::-1])
    assert passing not in known(told).known


def test_who_was_in_a_mask_of_somebody_tracked_goes_the_same_way_and_is_not_them() -> None:
    told = Told()
    told.start(OWN)
    for number in range(6):
        told.show(meeting(number)[0])
    (target,) = told.tracker._targets()
    person, record, others = target.person, target.world.now, PassersBy()
    assert np.hypot(*person.velocity) > 1
    for left in (180, 184):
        # The second time it is the one of before.
        mask = np.zeros(target.world.shape, np.uint8)
        mask[40:140, left : left + 30] = 255
        others.welcome(mask, (6.0, 2.0), record, person, target.config)
        (one,) = others.known
        assert one.not_track == person.track_id
        assert one.proven
        assert one.velocity == person.velocity
        # At half size.
        assert one.outline.window == (slice(21, 71), slice(93, 108))
        one.not_track = 0
    # Of a frame that is never learnt only the motion counts.
    record.bodies[one.number] = (4.0, -6.0)
    others.skip(record)
    assert one.outline.window == (slice(18, 68), slice(95, 110))


def test_what_stays_where_it_is_is_nobody() -> None:
    told = Told()
    told.start(OWN)
    for number in range(18):
        image, masks = picture((Figure(170, BLUE), OWN) if number > 4 else (OWN,))
        told.see(image, [masks[-1]])
        assert not any(each.proven for each in known(told).known)


def test_nobody_competes_before_having_gone_some_way() -> None:
    told = Told()
    told.start(OWN)
    competed = []
    for number in range(20):
        own, other = meeting(number)
        image, masks = picture((other, own))
        told.see(image, [masks[1]])
        (world,) = {target.world for target in told.tracker._targets()}
        proven = {each.number for each in known(told).known if each.proven}
        assert set(world.now.passers_by) <= proven
        competed.append(bool(world.now.passers_by))
    assert competed[-1]

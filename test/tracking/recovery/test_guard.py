# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Masks that go over to somebody who crosses, or show two people."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gait_segmentation.results import TrackResult
from gait_segmentation.tracking.recovery.lost_and_found import coasting
from gait_segmentation.tracking.target import Target
from test.tracking.figures import BLUE, RED, Figure, Told, picture

OWN = Figure(110)
MET, APART = 24, 30
"""Frames in which the two are at one place, and side by side again."""


def meeting(number: int, coat: tuple[int, int, int] = BLUE) -> tuple[Figure, Figure]:
    """Return somebody tracked, and somebody else who comes to meet them."""
    return replace(OWN, x=110 + 2.0 * number), Figure(215 - 2.5 * number, coat)


def meet(told: Told, until: int, coat: tuple[int, int, int] = BLUE) -> None:
    """Let the two meet, each with the mask that is right."""
    told.start(OWN)
    for number in range(until):
        own, other = meeting(number, coat)
        image, (_, mine) = picture((other, own))
        told.see(image, [mine])


def known(target: Target) -> tuple[object, ...]:
    """Return what is known in the newest frame of somebody followed."""
    person, memory = target.person, target.memory
    return (
        (target.state, target.confidence, target.box, target.whereabouts),
        vars(target.visibility).copy(),
        (person.box, person.velocity, id(person.mask), id(person.template)),
        (memory.pace, memory.lost_s, id(memory.silhouette), id(memory.appearance.signature)),
    )


def spy(owner: object, name: str, note: Callable[[Any], object]) -> None:
    """Let what a method returns be noted, each time it is called."""
    method = getattr(owner, name)

    def noting(*args: object, **options: object) -> object:
        result = method(*args, **options)
        note(result)
        return result

    setattr(owner, name, noting)


def center_x(result: TrackResult) -> float:
    assert result.body is not None
    return result.body.center_x


@pytest.mark.parametrize('watched', [True, False], ids=['watched', 'not watched'])
def test_masks_of_somebody_else_are_noticed_and_the_person_found_again(watched: bool) -> None:
    told = Told()
    told.start(OWN)
    (own, other), told_apart = meeting(0), False
    for number in range(MET + 16):
        own, other = meeting(number)
        image, (theirs, mine) = picture((other, own))
        # Dressed otherwise from head to foot.
        image[theirs > 0] = 255 - image[theirs > 0]
        if number < MET:
            told.see(image, [mine])
        elif number < MET + 4:
            (result,) = told.see(image, [theirs])
        else:
            (result,) = told.see(image, [theirs, mine], nearest=True)
        (target,) = told.tracker._targets()
        known = target.world.passers_by.known
        told_apart = told_apart or any(each.not_track == target.track_id for each in known)
        if not watched:
            target.guard.is_other = lambda *_, **__: False  # type: ignore[method-assign]
    on = own if watched else other
    assert abs(center_x(result) - on.x) < 12
    assert told_apart is watched


def test_somebody_who_walks_into_the_shade_stays_who_it_is() -> None:
    told = Told()
    told.start(OWN)
    verdicts: list[bool] = []
    for number in range(MET + 24):
        own, other = meeting(number)
        image, (_, mine) = picture((other, own))
        # Faster than the looks that are kept could follow.
        light = max(1 - 0.1 * max(number - APART, 0), 0.6)
        image[mine > 0] = (light * image[mine > 0]).astype(np.uint8)
        (result,) = told.see(image, [mine])
        assert result.state == 'tracked'
        assert abs(center_x(result) - own.x) < 15
        if number == 0:
            (target,) = told.tracker._targets()
            spy(target.guard, 'is_other', verdicts.append)
    # Not even looked for elsewhere, in vain.
    assert len(verdicts) > MET
    assert not any(verdicts)


def test_nothing_changes_while_the_person_is_not_to_be_found() -> None:
    one, two = Told(), Told()
    for told in (one, two):
        meet(told, MET)
    (target,) = two.tracker._targets()
    target.guard.is_other = lambda *_, **__: False  # type: ignore[method-assign]
    for number in range(MET, MET + 10):
        image, (theirs,) = picture((meeting(number)[1],))
        (first,), (second,) = one.see(image, [theirs]), two.see(image, [theirs])
        assert np.array_equal(first.likelihood, second.likelihood)
        assert (first.box, first.state) == (second.box, second.state)


def test_looking_for_the_person_in_vain_changes_nothing() -> None:
    told = Told()
    meet(told, MET)
    (target,) = told.tracker._targets()
    target.guard.is_other = lambda *_, **__: True  # type: ignore[method-assign]
    sought, before = [], []

    def search(*_: object) -> tuple[float, float, bool]:
        sought.append(target.state)
        return 30.0, 5.0, False

    target.memory.search = search  # type: ignore[method-assign]
    spy(target.learner, 'learn', lambda _: before.append(known(target)))
    image, (theirs,) = picture((meeting(MET)[1],))
    told.see(image, [theirs])
    assert sought == ['lost']
    assert [known(target)] == before


def alone(frames: int = 8) -> tuple[Told, Target]:
    """Return somebody who has walked alone."""
    told = Told()
    told.start(OWN)
    for number in range(frames):
        told.show(meeting(number)[0])
    (target,) = told.tracker._targets()
    return told, target


def test_the_person_is_sought_where_the_last_pace_would_have_led() -> None:
    _, target = alone()
    person, memory, seconds = target.person, target.memory, 0.04
    x, y, pace = person.center_x, person.center_y, memory.pace
    assert pace[0] == pytest.approx(50, abs=10)
    steps = 60
    for _ in range(steps):
        target.guard.carry((0.5, -0.25), seconds)
    target.guard.bring_back(person, memory)
    # After a second they are taken to stop.
    walked = sum(seconds * coasting(seconds * (k + 1)) for k in range(steps))
    assert walked < 0.75 * seconds * steps
    assert person.center_x == pytest.approx(x + 0.5 * steps + walked * pace[0])
    assert person.center_y == pytest.approx(y - 0.25 * steps + walked * pace[1])
    assert memory.lost_s == pytest.approx(seconds * steps)


def test_a_mask_that_was_too_large_leaves_a_doubt_until_one_is_sure() -> None:
    _, target = alone()
    person, memory, record = target.person, target.memory, target.world.now
    window = person.window(person.mask.shape)
    doubts = []
    for share in (1.0, 1.5, 0.7, 1.0):
        target.guard.is_other(
            person, memory, record, window, person.mask, (0.0, 0.0), share, about=False
        )
        doubts.append(target.guard.in_doubt)
    assert doubts == [False, True, True, False]


@pytest.mark.parametrize('coat', [BLUE, RED], ids=['otherwise dressed', 'alike'])
def test_of_two_who_may_both_be_the_person_neither_is_somebody_else(
    coat: tuple[int, int, int],
) -> None:
    told, target = alone()
    x, y = target.person.center_x, meeting(7)[0].y
    image, masks = picture((Figure(x - 30, y=y), Figure(x + 30, coat, y=y)))
    told.tracker.update(image, told.stamp_ns)
    both = masks[0] | masks[1]
    others = target.guard.others_in(
        target.person, target.memory, target.world.now, both, (0.0, 0.0)
    )
    if coat == RED:
        assert others is None
    else:
        assert others is not None
        np.testing.assert_array_equal(others > 0, masks[1] > 0)


@pytest.mark.parametrize('coat', [BLUE, RED], ids=['otherwise dressed', 'alike'])
def test_of_two_people_in_one_mask_the_person_is_kept(coat: tuple[int, int, int]) -> None:
    told = Told()
    meet(told, MET, coat)
    for number in range(MET, APART + 6):
        own, other = meeting(number, coat)
        image, masks = picture((other, own))
        told.see(image, [masks[0] | masks[1]])
    (target,) = told.tracker._targets()
    assert target.person.mask[own.mask() > 0].mean() > 200
    for mask in (target.person.mask, target.person.part):
        assert not mask[(masks[0] > 0) & (own.mask() == 0)].any()
    (world,) = {target.world for target in told.tracker._targets()}
    assert world.passers_by.known

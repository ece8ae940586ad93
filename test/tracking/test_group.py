# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What people of one world do to each other; see also the tests of losing and finding."""

from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.images import placed
from gait_segmentation.tracking import TrackingConfig, group
from gait_segmentation.tracking.strangers.beside import Beside
from gait_segmentation.tracking.strangers.newcomers import Neighbour
from gait_segmentation.tracking.strangers.passers_by import PassersBy
from test.tracking.figures import BLUE, STEP_NS, Figure, Told, picture


def test_each_gets_the_pixels_of_their_own() -> None:
    told = Told(slots=2)
    people = Figure(100), Figure(135, BLUE)
    told.start(*people)
    results = told.show(*people)
    _, masks = picture(people)
    for own, other, result in zip(masks, masks[::-1], results, strict=True):
        assert result.likelihood[own > 0].mean() > 180
        assert result.likelihood[other > 0].mean() < 100


def test_a_frame_is_learnt_once_and_its_people_are_no_background() -> None:
    told = Told(slots=2)
    people = Figure(60), Figure(200, BLUE)
    told.start(*people)
    told.show(*people)
    targets = told.tracker._targets()
    (world,) = {target.world for target in targets}
    group.learn(world, targets, STEP_NS, {}, TrackingConfig())
    image, masks = picture(people)
    group.follow(world, targets, image, world.now.image.stamp_ns + STEP_NS, TrackingConfig())
    count = world.now.background.count
    for mask in masks:
        assert count[mask > 0].max() < 0.5
    assert count[60:120, 85:95].min() > 0.9
    assert set(group.judge(world, targets)) == {1, 2}


def test_who_stands_nearer_hides_who_stands_behind() -> None:
    told = Told(slots=2)
    people = Figure(100, y=85.0), Figure(120, BLUE, y=95.0)
    told.start(*people)
    told.show(*people)
    far, near = told.tracker._targets()
    masks = [(each, each.window, each.carried_mask()) for each in (far, near)]
    shape, window = far.world.shape, far.window
    hidden, hiding = (placed(mask, about, shape) for _, about, mask in masks)
    cover = group._cover(far, masks, window)
    assert cover is not None
    np.testing.assert_array_equal(cover, hiding[window])
    assert group._cover(near, masks, window) is None
    visible = group._uncovered(far, masks[0][2], masks)
    np.testing.assert_array_equal(visible, (hidden & ~hiding)[window])
    assert visible.any()
    assert group._uncovered(near, masks[1][2], masks) is masks[1][2]


def test_each_frame_tells_who_has_company_in_it() -> None:
    told, own = Told(), Figure(110)
    told.start(own)
    told.show(own)
    (target,) = told.tracker._targets()
    alone = target.world.now
    for x in np.arange(215.0, 130.0, -5.0):
        image, (_, mine) = picture((Figure(float(x), BLUE), own))
        told.see(image, [mine])
    assert target.world.now.company == {target.track_id}
    assert target.accompanied
    assert not alone.company


def test_shortly_after_half_was_hidden_what_is_beside_may_be_the_rest(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    told = Told()
    path = [60 + 2.0 * k for k in range(35)] + [128 - 1.5 * k for k in range(40)]
    asked: list[tuple[float, bool]] = []

    def note(_: PassersBy, beside: Beside, neighbour: Neighbour, config: TrackingConfig) -> None:
        target = told.tracker._slots[0]
        assert target is not None
        asked.append((target.learner._area.share, neighbour.whole))

    monkeypatch.setattr(PassersBy, 'find', note)
    told.start(Figure(path[0]))
    for x in path:
        told.show(Figure(x), boards=[(130, 320)])
    hidden = max(k for k, (share, _) in enumerate(asked) if share < 0.75)
    after = asked[hidden + 1 :]
    assert any(share >= 0.9 and not whole for share, whole in after[:16])
    assert asked[5][1]
    assert after[-1][1]

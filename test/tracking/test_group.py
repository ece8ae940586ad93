# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What people of one world do to each other; see also the tests of losing and finding."""

from __future__ import annotations

import numpy as np

from gait_segmentation.images import placed
from gait_segmentation.tracking import TrackingConfig, group
from test.tracking.figures import BLUE, STEP_NS, Figure, Told, picture


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
    np.testing.assert_array_equal(cover, hiding[window])
    assert group._cover(near, masks, window) is None
    visible = group._uncovered(far, masks[0][2], masks)
    np.testing.assert_array_equal(visible, (hidden & ~hiding)[window])
    assert visible.any()
    assert group._uncovered(near, masks[1][2], masks) is masks[1][2]

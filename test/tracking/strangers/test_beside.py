# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a frame tells of the surroundings of people, at half of its size."""

from __future__ import annotations

import numpy as np

from gait_segmentation.ego_motion.world_motion import WorldMotion
from gait_segmentation.tracking.background.model import BackgroundModel
from gait_segmentation.tracking.picture.working import WorkingImage
from gait_segmentation.tracking.records import Record
from gait_segmentation.tracking.strangers.beside import Beside

SHAPE = (61, 81)
EVERYWHERE = (slice(0, 30), slice(0, 40))


def beside(moving: np.ndarray | None = None, count: float = 30.0) -> Beside:
    image = WorkingImage.of(np.zeros((*SHAPE, 3), np.uint8), 1, SHAPE)
    background = BackgroundModel(SHAPE)
    background.sums[..., 3] = count
    people = np.zeros(SHAPE, np.uint8)
    return Beside(Record(image, WorldMotion(), background, 0, []), people, moving)


def test_images_of_odd_size_lose_their_last_line() -> None:
    made = beside()
    assert made.shape == (30, 40)
    assert made.people.shape == made.strange.shape == made.moving.shape == made.shape


def test_windows_may_begin_anywhere() -> None:
    mask = np.zeros(SHAPE, np.uint8)
    mask[20:40, 30:50] = 255
    for top, left in ((11, 21), (12, 22)):
        made = beside()
        window = (slice(top, 51), slice(left, 71))
        made.add(window, (mask[window] > 0).astype(np.uint8), mask, mask)
        assert (made.strange == mask[:60:2, :80:2]).all()
        assert (made.masks > 0).sum() == (made.templates > 0).sum() == 100


def test_what_moves_is_strange_where_nothing_is_known() -> None:
    moving = np.zeros(SHAPE, np.uint8)
    moving[20:40, 30:50] = 1
    nothing = np.zeros(SHAPE, np.uint8)
    for count, found in ((0.0, 100), (30.0, 0)):
        made = beside(moving, count)
        made.add((slice(0, 61), slice(0, 81)), nothing, nothing, nothing)
        assert np.count_nonzero(made.strange) == found


def test_distances_are_those_from_templates() -> None:
    made = beside()
    assert made.far(EVERYWHERE, 100).all()
    made = beside()
    template = np.zeros(SHAPE, np.uint8)
    template[20:40, 30:50] = 255
    made.add((slice(0, 61), slice(0, 81)), np.zeros(SHAPE, np.uint8), template, template)
    far = made.far(EVERYWHERE, 4)
    assert far[15, 10]
    assert not far[15, 12]
    assert not far[15, 20]


def test_all_may_move_if_it_is_not_known() -> None:
    nothing = np.zeros(SHAPE, np.uint8)
    made = beside()
    made.add((slice(0, 61), slice(0, 81)), nothing, nothing, nothing)
    assert made.moving.all()
    moving = nothing.copy()
    moving[:30] = 1
    made = beside(moving)
    made.add((slice(0, 61), slice(0, 81)), nothing, nothing, nothing)
    assert np.count_nonzero(made.moving) == 15 * 40

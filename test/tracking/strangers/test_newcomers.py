# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Who is new beside a person, at half the size."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gait_segmentation.ego_motion.world_motion import WorldMotion
from gait_segmentation.tracking.background.model import BackgroundModel
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.outline import Outline
from gait_segmentation.tracking.person.appearance import Appearance
from gait_segmentation.tracking.person.person import Person, new_colours
from gait_segmentation.tracking.picture.working import WorkingImage
from gait_segmentation.tracking.records import Record
from gait_segmentation.tracking.strangers.beside import Beside
from gait_segmentation.tracking.strangers.newcomers import Neighbour, newcomers

SHAPE = (120, 200)
EVERYWHERE = (slice(0, 120), slice(0, 200))
Block = tuple[int, int, int, int]
"""First and last row, first and last column."""

OWN = (10, 110, 70, 95)
OTHER = (12, 108, 130, 155)


def drawn(*blocks: Block) -> np.ndarray:
    image = np.zeros(SHAPE, np.uint8)
    for top, bottom, left, right in blocks:
        image[top:bottom, left:right] = 255
    return image


def look(strange: np.ndarray, moving: np.ndarray | None, *, known: bool = True) -> Beside:
    """Return what a frame tells with one person in it, where the background is known or not."""
    own = drawn(OWN)
    background = BackgroundModel(SHAPE)
    background.sums[..., 3] = 30.0 if known else 0.0
    image = WorkingImage.of(np.zeros((*SHAPE, 3), np.uint8), 1, SHAPE)
    beside = Beside(Record(image, WorldMotion(), background, 0, []), own, moving)
    beside.add(EVERYWHERE, (strange > 0).astype(np.uint8), own, own)
    return beside


def neighbour(**seen: bool) -> Neighbour:
    config = TrackingConfig()
    person = Person(1, 82.5, 60.0, 100.0, 12.5, 12.5, drawn(OWN), *new_colours(config))
    options = {'whole': True, 'inside': True} | seen
    return Neighbour(person, Appearance(), EVERYWHERE, **options)


def test_what_is_strange_large_apart_and_moves_is_somebody() -> None:
    both = drawn(OWN, OTHER)
    (found,) = newcomers(look(both, both), neighbour(), [])
    rows, columns = found.window
    assert (rows.start, rows.stop) == pytest.approx((6, 54), abs=1)
    assert (columns.start, columns.stop) == pytest.approx((65, 78), abs=1)


@pytest.mark.parametrize(
    'block',
    [(90, 108, 130, 155), (12, 108, 96, 103), (12, 20, 130, 134)],
    ids=['low', 'at the person', 'small'],
)
def test_what_is_low_near_or_small_is_nobody(block: Block) -> None:
    both = drawn(OWN, block)
    assert newcomers(look(both, both), neighbour(), []) == []


def test_what_does_not_move_is_nobody() -> None:
    both = drawn(OWN, OTHER)
    assert newcomers(look(both, drawn(OWN)), neighbour(), []) == []
    assert len(newcomers(look(both, None), neighbour(), [])) == 1


def test_what_moves_is_somebody_where_nothing_is_known_yet() -> None:
    both, own = drawn(OWN, OTHER), drawn(OWN)
    assert len(newcomers(look(own, both, known=False), neighbour(), [])) == 1
    assert newcomers(look(own, both), neighbour(), []) == []


def test_who_is_known_is_not_found_again() -> None:
    both = drawn(OWN, OTHER)
    outline = Outline.of(drawn(OTHER)[::2, ::2].copy())
    assert newcomers(look(both, both), neighbour(), [(outline, 5.0)]) == []


def test_parts_above_each_other_are_of_one_person() -> None:
    both = drawn(OWN, (12, 55, 130, 155), (70, 108, 132, 150))
    assert len(newcomers(look(both, both), neighbour(), [])) == 1


def test_what_touches_somebody_seen_in_part_may_be_the_rest() -> None:
    both = drawn(OWN, (12, 108, 96, 150))
    assert len(newcomers(look(both, both), neighbour(), [])) == 1
    assert newcomers(look(both, both), neighbour(whole=False), []) == []
    assert newcomers(look(both, both), neighbour(inside=False), []) == []


def test_nobody_is_beside_somebody_out_of_the_image() -> None:
    both = drawn(OWN, OTHER)
    out = replace(neighbour(), window=(slice(120, 120), slice(0, 80)))
    assert newcomers(look(both, both), out, []) == []

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.starting.finding.shapes import BodyShapes, normalised, tanimoto
from test.walkers import box_of, clip, small_bank


def test_a_shape_is_the_same_at_any_size_and_aspect() -> None:
    region = np.zeros((48, 24), np.uint8)
    region[:, 6:18] = region[10:20] = 255
    shape = normalised(region)
    assert shape.shape == (24, 48)
    for other in (normalised(region.repeat(3, axis=0).repeat(3, axis=1)),
                  normalised(region.repeat(2, axis=1), 0.5)):  # fmt: skip
        assert tanimoto(shape, other) == pytest.approx(1, abs=0.03)


def test_what_is_wider_than_twice_its_height_has_no_shape() -> None:
    assert normalised(np.full((10, 30), 255, np.uint8)) is None


def test_a_walker_is_more_like_a_body_than_a_box_is() -> None:
    shapes, frame = BodyShapes(small_bank()), clip(pan=0.0, frames=40)[20]
    rows, columns = box_of(frame).slices(*frame.masks[0].shape[::-1])
    walker = normalised(frame.masks[0][rows, columns])
    box = normalised(np.full((60, 24), 255, np.uint8))
    assert shapes.likeness(walker) > 0.7 > shapes.likeness(box)

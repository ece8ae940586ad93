# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import math

import pytest
from hypothesis import given

from gait_segmentation.geometry import (
    BodyFrame,
    compose,
    invert,
    pixel_affine,
    reach,
    scaling,
    template_to_image,
)
from test.geometry.strategies import bodies, sizes


@given(bodies)
def test_template_to_image_puts_head_and_feet_where_the_body_is(body: BodyFrame) -> None:
    transform = template_to_image(body, 96, 64, 0.9)
    middle = transform @ [32, 48, 1]
    head = transform @ [32, 48 - 0.45 * 96, 1]
    assert middle == pytest.approx([body.center_x, body.center_y], abs=1e-6)
    assert math.dist(middle, head) == pytest.approx(body.height / 2)
    # A positive angle leans the head to the right.
    assert head[0] - middle[0] == pytest.approx(math.sin(body.angle) * body.height / 2, abs=1e-6)


@given(bodies)
def test_inverse_and_composition_cancel(body: BodyFrame) -> None:
    transform = template_to_image(body, 96, 64, 0.9)
    assert compose(invert(transform), transform) == pytest.approx(scaling(1), abs=1e-6)


def test_pixel_affine_keeps_pixel_centres() -> None:
    # Doubling the size carries the centre of pixel 0 (position 0.5) to position 1, index 0.5.
    matrix = pixel_affine(scaling(2))
    assert matrix @ [0, 0, 1] == pytest.approx([0.5, 0.5])
    assert pixel_affine(scaling(1)) == pytest.approx(scaling(1))


@given(bodies, sizes, sizes)
def test_a_grid_reaches_to_its_corners(body, width, height):
    transform = template_to_image(body, 96, 64, 0.9)
    corners = transform @ [[0, width, width, 0], [0, 0, height, height], [1, 1, 1, 1]]
    sides = *corners.min(axis=1), *corners.max(axis=1)
    assert reach(transform, width, height) == pytest.approx(sides, abs=1e-6)

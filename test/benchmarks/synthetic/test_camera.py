# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from benchmarks.synthetic.camera import EYE_LEVEL, SyntheticCamera, SyntheticConfig


def _camera(**values: object) -> SyntheticCamera:
    config = SyntheticConfig(**{'width': 80, 'height': 60, 'frames': 11, 'jitter': 0.0} | values)
    return SyntheticCamera(config, np.random.default_rng(1))


def test_the_first_walker_is_in_the_middle_and_as_tall_as_asked_for() -> None:
    camera = _camera(person_height=40.0)
    body = camera.body_at(0.0, camera.distance, 5)
    assert (body.center_x, body.center_y, body.height) == pytest.approx((40, 30, 40))
    # Eyes are at one height at every distance.
    near, far = (camera.body_at(0.0, k * camera.distance, 5) for k in (0.5, 2.0))
    eyes = [each.center_y - (EYE_LEVEL - 0.5) * each.height for each in (body, near, far)]
    assert eyes == pytest.approx([eyes[0]] * 3)
    assert (near.height, far.height) == pytest.approx((80, 20))


def test_a_panned_camera_sees_the_near_pass_faster() -> None:
    camera = _camera(pan=2.0, person_height=40.0)

    def passed(distance: float) -> float:
        first, last = (camera.body_at(0.0, distance, number).center_x for number in (0, 10))
        return first - last

    assert passed(camera.distance) == pytest.approx(20)
    assert passed(2 * camera.distance) == pytest.approx(10)


def test_a_view_is_cut_out_of_the_whole_place() -> None:
    camera = _camera(pan=2.0)
    place = np.zeros(camera.place_shape, np.uint8)
    place[:, camera.margin_x + 40 :] = 200
    for number, edge in ((5, 40), (10, 30)):
        view = camera.view(place, number, 1.0)
        assert view.shape == (60, 80)
        assert (view[:, : edge - 1] < 20).all()
        assert (view[:, edge + 1 :] > 180).all()

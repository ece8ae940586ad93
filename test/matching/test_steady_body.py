# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import astuple

import numpy as np
import pytest

from gait_segmentation.geometry import BodyFrame
from gait_segmentation.matching.steady_body import SteadyBody

FPS = 25


def walk(speed=(0.0, 0.0), growth=0.0, noise=0.0, frames=40):
    rng = np.random.default_rng(0)
    for number in range(frames):
        t = number / FPS
        true = BodyFrame(50 + speed[0] * t, 80 + speed[1] * t, 100 * np.exp(growth * t), 0.1)
        dx, dy, dh = rng.normal(0, noise, 3)
        body = BodyFrame(true.center_x + dx, true.center_y + dy, true.height + dh, true.angle)
        yield t, true, body


def errors(*args, **kwargs):
    steady = SteadyBody()
    found = [(steady.update(body, t), true, body) for t, true, body in walk(*args, **kwargs)]
    assert all(result.angle == true.angle for result, true, _ in found)
    return np.array(
        [(r.center_x - t.center_x, r.center_y - t.center_y, r.height - t.height)
         for r, t, _ in found]
    )  # fmt: skip


def test_the_first_body_is_taken_as_it_is():
    body = BodyFrame(3.0, 4.0, 50.0, 0.2)
    assert astuple(SteadyBody().update(body, 1.0)) == pytest.approx(astuple(body))


def test_noise_is_averaged():
    assert errors(noise=1.0)[15:].std() < 0.5


def test_motion_is_followed():
    assert np.abs(errors((80.0, -10.0), 0.1))[20:].max() < 2.0


def test_jumps_are_taken_at_once():
    steady = SteadyBody()
    for t, _, body in walk():
        steady.update(body, t)
    far = BodyFrame(150.0, 80.0, 100.0)
    assert astuple(steady.update(far, 40 / FPS)) == pytest.approx(astuple(far))
    steady.reset()
    tall = BodyFrame(50.0, 80.0, 200.0)
    assert astuple(steady.update(tall, 41 / FPS)) == pytest.approx(astuple(tall))


def test_what_was_before_a_pause_says_nothing():
    steady = SteadyBody()
    for t, _, body in walk((80.0, 0.0)):
        steady.update(body, t)
    after = BodyFrame(body.center_x + 9.0, 81.0, 103.0, 0.1)
    assert astuple(steady.update(after, t + 0.9)) == pytest.approx(astuple(after))

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.gait_model.body import make_body
from gait_segmentation.gait_model.build import Build
from gait_segmentation.gait_model.projection import extent, project
from gait_segmentation.gait_model.skeleton import walk
from gait_segmentation.gait_model.solid import PARTS

POSE = walk(np.arange(12) / 12)


def worn(build, part):
    """Return left, top, right and bottom of the ellipsoids of a part in profile."""
    body = make_body(POSE, build)
    pieces = (p for p, kind in zip(body.pieces, body.parts, strict=True) if PARTS[kind] == part)
    members = sorted({member for piece in pieces for member in piece})
    centers, axes, _ = project(body, 0.0)
    return extent(centers[:, members], axes[:, members])


@pytest.mark.parametrize('hem', [0.15, 0.3, 0.42])
def test_a_hem_hangs_where_it_should(hem):
    bottom = worn(Build(hem=hem), 'skirt')[3]
    hips = -POSE.pelvis[:, 2]
    # Measured down the straighter leg; the other one only lifts the cloth.
    assert (bottom - hips).max() == pytest.approx(hem, abs=0.02)


def test_cloth_spans_both_legs_and_opens_with_the_step():
    left, _, right, _ = worn(Build(hem=0.35), 'skirt')
    assert (right - left)[0] > 1.2 * (right - left).min()
    wide = worn(Build(hem=0.35, flare=0.05), 'skirt')
    assert ((wide[2] - wide[0]) >= (right - left) - 1e-9).all()


def test_a_rucksack_is_on_the_back_and_as_deep_as_said():
    thin, thick = worn(Build(rucksack=0.06), 'rucksack'), worn(Build(rucksack=0.16), 'rucksack')
    assert (thin[0] < -0.1).all()
    assert (thin[0] - thick[0]) == pytest.approx(np.full(12, 0.10), abs=0.02)
    assert (-thick[1] < POSE.neck[:, 2] + 0.03).all()

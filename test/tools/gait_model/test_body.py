# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.errors import BankError
from gait_tools.gait_model.body import (
    BUILDS,
    FIGURES,
    PARTS,
    Body,
    Build,
    make_body,
    named_build,
)
from gait_tools.gait_model.render import extent, project
from gait_tools.gait_model.skeleton import Frame, walk

PHASES = np.arange(10) / 10


def body_of(build):
    return make_body(walk(PHASES), build)


def test_sizes_of_an_ellipsoid_go_along_its_frame():
    x, y, z = np.eye(3)[:, None]
    body = Body()
    body.hull('head', body.ellipsoid(x, Frame(along=x, front=y, left=z), 0.1, 0.2, 0.3))
    # Breadth goes to the left, depth to the front and length along.
    assert pytest.approx(np.array([0.1 * z[0], 0.2 * y[0], 0.3 * x[0]])) == body.axes[0, 0].T


@pytest.mark.parametrize('name', sorted(BUILDS))
def test_bodies_are_consistent(name):
    body = body_of(BUILDS[name])
    count = body.centers.shape[1]
    assert body.centers.shape == (len(PHASES), count, 3)
    assert body.axes.shape == (len(PHASES), count, 3, 3)
    assert len(body.pieces) == len(body.parts)
    used = {member for piece in body.pieces for member in piece}
    assert used == set(range(count))
    assert np.isfinite(body.centers).all()
    assert np.isfinite(body.axes).all()


def test_clothes_add_their_parts():
    def parts(build):
        return {PARTS[part] for part in body_of(build).parts}

    plain = set(PARTS) - {'skirt', 'rucksack'}
    assert parts(Build()) == plain
    assert parts(Build(hem=0.2)) == plain | {'skirt'}
    assert parts(Build(rucksack=0.1)) == plain | {'rucksack'}


def test_a_walker_is_as_tall_as_the_stature_says():
    _, top, _, bottom = extent(*project(body_of(Build()), (0.0, 0.0))[:2])
    height = bottom - top
    assert 0.96 < height.mean() < 1.02
    assert np.abs(bottom).max() < 0.01  # soles are on the ground


def test_girth_and_cloth_thicken():
    def depth(build):
        left, _, right, _ = extent(*project(body_of(build), (np.pi / 2, 0.0))[:2])
        return float((right - left).mean())

    assert depth(Build(girth=0.8)) < depth(Build()) < depth(Build(girth=1.3))
    assert depth(Build()) < depth(Build(sleeve_cloth=0.02))


def test_larger_shoes_are_thicker():
    feet = PARTS.index('feet')

    def thickness(shoe):
        body = make_body(walk(PHASES, shoe=shoe), Build(shoe=shoe))
        used = {
            m
            for piece, part in zip(body.pieces, body.parts, strict=True)
            for m in piece
            if part == feet
        }
        return float(np.abs(body.axes[:, sorted(used)]).sum())

    assert thickness(0.8) < thickness(1.0) < thickness(1.3)


def test_names_and_builds_are_both_taken():
    assert named_build('average') is BUILDS['average']
    own = Build(girth=1.3)
    assert named_build(own) is own


def test_an_unknown_name_is_refused_with_the_known_ones():
    with pytest.raises(BankError, match=r"average.*got 'giant'"):
        named_build('giant')


def test_made_up_walkers_have_builds_that_exist():
    assert set(FIGURES) <= set(BUILDS)
    assert len(set(FIGURES)) == len(FIGURES)


POSE = walk(np.arange(12) / 12)


def worn(build, part):
    """Return left, top, right and bottom of the ellipsoids of a part in profile."""
    body = make_body(POSE, build)
    pieces = (p for p, kind in zip(body.pieces, body.parts, strict=True) if PARTS[kind] == part)
    members = sorted({member for piece in pieces for member in piece})
    centers, axes, _ = project(body, (0.0, 0.0))
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

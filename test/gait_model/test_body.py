# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.gait_model.body import make_body
from gait_segmentation.gait_model.build import BUILDS, Build
from gait_segmentation.gait_model.projection import extent, project
from gait_segmentation.gait_model.skeleton import walk
from gait_segmentation.gait_model.solid import PARTS

PHASES = np.arange(10) / 10


def body_of(build):
    return make_body(walk(PHASES), build)


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
    _, top, _, bottom = extent(*project(body_of(Build()), 0.0)[:2])
    height = bottom - top
    assert 0.96 < height.mean() < 1.02
    assert np.abs(bottom).max() < 0.01  # soles are on the ground


def test_girth_and_cloth_thicken():
    def depth(build):
        left, _, right, _ = extent(*project(body_of(build), np.pi / 2)[:2])
        return float((right - left).mean())

    assert depth(Build(girth=0.8)) < depth(Build()) < depth(Build(girth=1.3))
    assert depth(Build()) < depth(Build(sleeve_cloth=0.02))


def test_the_head_is_carried_forward_and_the_trunk_is_not():
    usual, forward = body_of(Build()), body_of(Build(head=0.03))
    head = PARTS.index('head')
    for part in range(len(PARTS)):
        moved = [
            forward.centers[:, member] - usual.centers[:, member]
            for piece, owner in zip(usual.pieces, usual.parts, strict=True)
            if owner == part
            for member in piece
        ]
        farthest = max((float(np.abs(move).max()) for move in moved), default=0.0)
        assert farthest == pytest.approx(0.03 if part == head else 0.0, abs=0.003)


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

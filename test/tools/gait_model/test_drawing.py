# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The gait model, from which banks are drawn; of the average walker, the bank says every bit."""

from __future__ import annotations

import json

import numpy as np
import pytest

from gait_segmentation.errors import BankError, ConfigError
from gait_segmentation.gait_model import default_bank
from gait_tools.gait_model.body import BUILDS, PARTS, Build, body_at
from gait_tools.gait_model.builder import DIRECTIONS, BankSpec, build_bank
from gait_tools.gait_model.render import (
    draw,
    extent,
    project,
    render_cycle,
    render_parts,
    render_silhouette,
    view_matrix,
)
from gait_tools.gait_model.skeleton import SIDES, speed_law, walk

PHASES = np.arange(12) / 12
SMALL = BankSpec(height=48, width=32, azimuths=4, phases=6, builds='average, stout')


def test_the_shipped_bank_is_the_one_that_is_drawn():
    drawn, shipped = build_bank(), default_bank()
    assert shipped.provenance == drawn.provenance
    assert shipped.fill == drawn.fill
    for ours, theirs in ((drawn, shipped), (drawn.finer, shipped.finer)):
        assert np.array_equal(ours.templates, theirs.templates)
        assert np.array_equal(ours.azimuth, theirs.azimuth)
        assert ours.builds == theirs.builds


def test_bank_has_what_the_specification_says():
    done = []
    bank = build_bank(SMALL, lambda: done.append(1))
    assert bank.templates.shape == (8, 6, 48, 32)
    assert bank.builds == ('average',) * 4 + ('stout',) * 4
    assert bank.azimuth[:4] == pytest.approx([0, np.pi / 2, np.pi, -np.pi / 2])
    assert len(np.unique(bank.templates)) <= 8
    assert bank.templates.min() == 0
    assert bank.templates.max() == 255
    assert len(done) == 8 + 2 * DIRECTIONS
    assert json.loads(bank.provenance['spec'])['phases'] == 6
    assert BankSpec(azimuths=2).azimuth_values == pytest.approx((0.0, np.pi))


def test_finer_views_are_of_the_same_walkers():
    drawn = build_bank(BankSpec(azimuths=4, phases=4, builds='average,coat'))
    finer = drawn.finer
    assert (finer.grid, finer.phases, finer.fill) == ((48, 32), drawn.phases, drawn.fill)
    for sequence, build in enumerate(drawn.builds):
        away = np.abs(np.exp(1j * finer.azimuth) - np.exp(1j * drawn.azimuth[sequence]))
        (same,) = (k for k, name in enumerate(finer.builds) if name == build and away[k] < 1e-5)
        full = drawn.templates[sequence].astype(float).reshape(4, 48, 2, 32, 2).mean((2, 4))
        assert np.abs(full - finer.templates[same]).mean() < 2


def test_bad_input():
    with pytest.raises(ConfigError, match='phases must be an integer from 4 to 240, got 1'):
        BankSpec(phases=1)
    with pytest.raises(BankError, match=r"build must be one of.*average.*got 'none'"):
        build_bank(BankSpec(builds='average,none'))
    with pytest.raises(BankError, match=r'height_px must be a positive number.*got -3'):
        render_silhouette(0.0, 0.0, -3.0)
    with pytest.raises(BankError, match=r'fill must be in \(0, 1\], got 2'):
        render_silhouette(0.0, 0.0, 30.0, fill=2)


@pytest.mark.parametrize('name', sorted(BUILDS))
@pytest.mark.parametrize('azimuth', [0.0, 1.2])
def test_registration(name, azimuth):
    height, width, fill = 96, 64, 0.9
    cycle = render_cycle(PHASES, azimuth, build=name, grid=(height, width), fill=fill)
    inside = cycle >= 128
    tops = [np.flatnonzero(m.any(axis=1))[0] for m in inside]
    bottoms = [np.flatnonzero(m.any(axis=1))[-1] + 1 for m in inside]
    assert np.mean(bottoms) - np.mean(tops) == pytest.approx(fill * height, abs=1.5)
    assert (np.mean(bottoms) + np.mean(tops)) / 2 == pytest.approx(height / 2, abs=1.0)
    assert np.ptp(tops) <= 4
    mass = np.cumsum(cycle.sum(axis=1, dtype=float), axis=1)
    medians = [np.interp(m[-1] / 2, m, np.arange(1, width + 1)) for m in mass]
    assert np.mean(medians) == pytest.approx(width / 2, abs=0.7)
    # Nothing is cut off.
    assert not cycle[:, 0].any()
    assert not cycle[:, -1].any()
    assert cycle[:, :, [0, -1]].max() < 128


def test_size_and_ground_of_a_single_picture():
    image = render_silhouette(0.3, 0.0, 90.0, fill=0.9)
    assert image.shape == (100, 72)
    rows = np.flatnonzero((image >= 128).any(axis=1))
    assert rows[-1] + 1 == pytest.approx(50 + 45, abs=1)
    moved = render_silhouette(0.3, 0.0, 90.0, fill=0.9, shift=(2.0, -3.0))
    assert (moved[:-3, 2:] == image[3:, :-2]).all()


@pytest.mark.parametrize('azimuth', [0.0, np.pi / 2, -np.pi / 2])
def test_parts_add_up_to_the_silhouette(azimuth):
    kwargs = {'build': Build(hem=0.25, rucksack=0.1)}
    parts = render_parts(0.1, azimuth, 120.0, **kwargs)
    whole = render_silhouette(0.1, azimuth, 120.0, **kwargs).astype(int)
    assert tuple(parts) == PARTS
    total = sum(part.astype(int) for part in parts.values())
    assert np.abs(total - whole).max() <= len(PARTS) / 2


def test_a_rucksack_is_seen_from_behind_and_not_from_the_front():
    behind = render_parts(0.1, np.pi / 2, 120.0, build='rucksack')['rucksack'].sum(dtype=int)
    front = render_parts(0.1, -np.pi / 2, 120.0, build='rucksack')['rucksack'].sum(dtype=int)
    assert behind > 10 * front


def test_heads_are_above_feet():
    parts = render_parts(0.0, 0.4, 120.0)
    row = {
        name: np.average(np.arange(len(a)), weights=a.sum(axis=1, dtype=float) + 1e-9)
        for name, a in parts.items()
    }
    assert row['head'] < row['torso'] < row['legs'] < row['feet']


@pytest.mark.parametrize(
    ('azimuth', 'right', 'away'),
    [(0, 1, 0), (np.pi / 2, 0, 1), (np.pi, -1, 0), (-np.pi / 2, 0, -1)],
)
def test_azimuth_is_the_walking_direction(azimuth, right, away):
    forward = view_matrix(azimuth) @ (1, 0, 0)
    assert forward == pytest.approx((right, 0, away), abs=1e-12)


def test_up_is_up_and_a_camera_looking_down_sees_the_head_nearer():
    down, away = (view_matrix(0.0, 0.3) @ (0, 0, 1))[1:]
    assert down < 0
    assert away < 0


def body_of(**changes):
    return body_at(PHASES, Build(**changes))


def worn(part, **changes):
    """Return left, top, right and bottom of the ellipsoids of a part in profile."""
    body = body_of(**changes)
    pieces = (p for p, kind in zip(body.pieces, body.parts, strict=True) if PARTS[kind] == part)
    members = sorted({member for piece in pieces for member in piece})
    centers, axes, _ = project(body, (0.0, 0.0))
    return extent(centers[:, members], axes[:, members])


@pytest.mark.parametrize('name', sorted(BUILDS))
def test_clothes_add_their_parts(name):
    build = BUILDS[name]
    body = body_at(PHASES, build)
    clothes = {'skirt': build.hem > 0, 'rucksack': build.rucksack > 0}
    assert {PARTS[part] for part in body.parts} == {n for n in PARTS if clothes.get(n, True)}
    assert np.isfinite(body.centers).all()
    assert np.isfinite(body.axes).all()


def test_girth_and_cloth_thicken():
    def breadth(**changes):
        left, _, right, _ = extent(*project(body_of(**changes), (np.pi / 2, 0.0))[:2])
        return float((right - left).mean())

    assert breadth(girth=0.8) < breadth() < breadth(girth=1.3)
    assert breadth() < breadth(sleeve_cloth=0.02)


def test_larger_shoes_are_longer_and_thicker_and_stay_on_the_ground():
    small, large = (worn('feet', shoe=shoe) for shoe in (0.8, 1.3))
    assert ((large[2] - large[0]) > (small[2] - small[0])).all()
    joints = walk(PHASES, shoe=1.3).joints
    feet = [f'{side}_{end}' for side in SIDES for end in ('heel', 'ball', 'toe')]
    assert np.min([joints[name][:, 2] for name in feet], axis=0) == pytest.approx(0, abs=1e-12)
    sizes = [np.abs(body_of(shoe=shoe).axes).sum() for shoe in (0.8, 1.0, 1.3)]
    assert sizes == sorted(sizes)


@pytest.mark.parametrize('hem', [0.15, 0.3, 0.42])
def test_a_hem_hangs_where_it_should_and_opens_with_the_step(hem):
    left, _, right, bottom = worn('skirt', hem=hem)
    # Measured down the straighter leg; the other one only lifts the cloth.
    hips = -walk(PHASES, speed=Build().speed, arm_swing=1.1).pelvis[:, 2]
    assert (bottom - hips).max() == pytest.approx(hem, abs=0.02)
    assert (right - left)[0] > 1.1 * (right - left).min()
    wide = worn('skirt', hem=hem, flare=0.05)
    assert ((wide[2] - wide[0]) >= (right - left) - 1e-9).all()


def test_a_rucksack_is_on_the_back_and_as_deep_as_said():
    thin, thick = worn('rucksack', rucksack=0.06), worn('rucksack', rucksack=0.16)
    assert (thin[0] < -0.1).all()
    assert (thin[0] - thick[0]) == pytest.approx(np.full(12, 0.10), abs=0.02)


def test_the_arms_swing_as_far_as_the_build_says():
    def swing(side, **changes):
        wrist = walk(PHASES, **changes).joints[f'{side}_wrist']
        return float(np.ptp(wrist[:, 0]))

    assert swing('left') == pytest.approx(swing('right'), rel=1e-6)
    assert swing('left', arm_swing=0.0) < 0.2 * swing('left')
    assert swing('left', arm_balance=1.0) > 1.5 * swing('left') > 5 * swing('right', arm_balance=1)
    lean = walk(PHASES, lean=0.2).neck - walk(PHASES).neck
    assert (lean[:, 0] > 0.04).all()


def test_speed_law_at_its_nodes_and_between():
    assert speed_law('hip', 0.0) == (1.0, 0.0)
    assert speed_law('knee', -2.0) == (0.71, pytest.approx(np.deg2rad(-6.7)))
    assert speed_law('hip', 1.5)[0] == pytest.approx((1.15 + 1.24) / 2)
    assert speed_law('elbow', 2.0) == (1.0, 0.0)


def ellipse(width, height):
    axes = np.zeros((1, 2, 3))
    axes[0, 0, 0], axes[0, 1, 1] = width, height
    return axes


def test_what_lies_outside_of_the_canvas_is_left_out_and_later_pieces_cover_earlier_ones():
    for x, y in ((-50.0, 4.0), (50.0, 4.0), (4.0, -50.0), (4.0, 50.0)):
        assert not draw((8, 8), np.array([[x, y]]), ellipse(3.0, 3.0), [(0,)], [1]).any()
    assert draw((8, 8), np.array([[4.0, 4.0]]), ellipse(100.0, 100.0), [(0,)], [1]).all()
    axes = np.concatenate([ellipse(4.0, 4.0), ellipse(1.0, 1.0)])
    canvas = draw((9, 9), np.full((2, 2), 4.5), axes, [(0,), (1,)], [3, 7])
    assert canvas[4, [4, 1]].tolist() == [7, 3]

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.errors import BankError
from gait_segmentation.gait_model.build import BUILDS, Build
from gait_segmentation.gait_model.render import (
    register,
    render_cycle,
    render_parts,
    render_silhouette,
)
from gait_segmentation.gait_model.solid import PARTS

PHASES = np.arange(12) / 12


def tanimoto(first, second):
    return np.minimum(first, second).sum() / np.maximum(first, second).sum()


@pytest.mark.parametrize('azimuth', [0.0, np.pi])
def test_half_cycles_look_alike_in_profile(azimuth):
    cycle = render_cycle(PHASES, azimuth)
    for phase in range(6):
        assert tanimoto(cycle[phase].astype(int), cycle[phase + 6].astype(int)) > 0.93


def test_oblique_views_tell_the_half_cycles_apart():
    cycle = render_cycle(PHASES, np.pi / 4).astype(int)
    assert tanimoto(cycle[0], cycle[6]) < 0.9


@pytest.mark.parametrize('azimuth', [0.0, 0.7, -1.2])
def test_a_mirrored_view_is_the_mirrored_walker_half_a_stride_later(azimuth):
    cycle = render_cycle(PHASES, azimuth).astype(int)
    other = render_cycle(PHASES + 0.5, np.pi - azimuth)[:, :, ::-1].astype(int)
    assert tanimoto(cycle, other) > 0.97


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


def test_edges_are_soft_and_the_inside_is_full():
    image = render_silhouette(0.1, 0.0, 100.0)
    assert image.dtype == np.uint8
    assert image.max() == 255
    assert 10 < len(np.unique(image)) <= 17


def test_size_and_ground_of_a_single_picture():
    image = render_silhouette(0.3, 0.0, 90.0, fill=0.9)
    assert image.shape == (100, 72)
    rows = np.flatnonzero((image >= 128).any(axis=1))
    assert rows[-1] + 1 == pytest.approx(50 + 45, abs=1)
    moved = render_silhouette(0.3, 0.0, 90.0, fill=0.9, shift=(2.0, -3.0))
    assert (moved[:-3, 2:] == image[3:, :-2]).all()


def test_size_of_the_picture_does_not_change_the_shape():
    small = render_silhouette(0.2, 0.5, 60.0).sum() / 60**2
    large = render_silhouette(0.2, 0.5, 240.0).sum() / 240**2
    assert small == pytest.approx(large, rel=0.01)


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


def test_registration_is_kept():
    assert register(Build(), 0.0, 0.0) is register(Build(), 0.0, 0.0)


def test_bad_input():
    with pytest.raises(BankError, match=r'height_px must be a positive number.*got -3'):
        render_silhouette(0.0, 0.0, -3.0)
    with pytest.raises(BankError, match=r'fill must be in \(0, 1\], got 2'):
        render_silhouette(0.0, 0.0, 30.0, fill=2)
    with pytest.raises(BankError, match='build must be one of'):
        render_cycle([0.0], 0.0, build='nobody')

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The gait model, from which banks are drawn; of the average walker, the bank says every bit."""

import json

import numpy as np
import pytest

from gait_segmentation.gait_model import default_bank
from gait_tools.gait_model.body import BUILDS, PARTS, Build
from gait_tools.gait_model.builder import DIRECTIONS, BankSpec, build_bank
from gait_tools.gait_model.render import render_cycle, render_parts, render_silhouette

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
    assert len(done) == 8 + 2 * DIRECTIONS
    assert json.loads(bank.provenance['spec'])['phases'] == 6
    assert BankSpec(azimuths=2).azimuth_values == pytest.approx((0.0, np.pi))


@pytest.mark.parametrize('name', sorted(BUILDS))
def test_registration(name):
    height, width, fill = 96, 64, 0.9
    cycle = render_cycle(np.arange(12) / 12, 1.2, build=name, grid=(height, width), fill=fill)
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


@pytest.mark.parametrize('azimuth', [0.0, np.pi / 2, -np.pi / 2])
def test_parts_add_up_to_the_silhouette(azimuth):
    kwargs = {'build': Build(hem=0.25, rucksack=0.1)}
    parts = render_parts(0.1, azimuth, 120.0, **kwargs)
    whole = render_silhouette(0.1, azimuth, 120.0, **kwargs).astype(int)
    assert tuple(parts) == PARTS
    total = sum(part.astype(int) for part in parts.values())
    assert np.abs(total - whole).max() <= len(PARTS) / 2

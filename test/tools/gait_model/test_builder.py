# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import json

import numpy as np
import pytest

from gait_segmentation.errors import BankError, ConfigError
from gait_segmentation.gait_model import default_bank
from gait_tools.gait_model.builder import DIRECTIONS, BankSpec, build_bank

SMALL = BankSpec(height=48, width=32, azimuths=4, phases=6, builds='average, stout')


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


def test_the_same_bank_twice():
    assert (build_bank(SMALL).templates == build_bank(SMALL).templates).all()


def test_two_azimuths_are_both_side_views():
    assert BankSpec(azimuths=2).azimuth_values == pytest.approx((0.0, np.pi))


def test_neighbouring_phases_are_more_alike_than_far_ones():
    bank = build_bank(BankSpec(height=48, width=32, azimuths=1, phases=20))
    soft = bank.templates[0].astype(int)

    def alike(lag):
        other = np.roll(soft, lag, axis=0)
        return np.minimum(soft, other).sum() / np.maximum(soft, other).sum()

    assert alike(1) > 0.7 > alike(5)


def test_bad_specifications():
    with pytest.raises(ConfigError, match='phases must be an integer from 4 to 240, got 1'):
        BankSpec(phases=1)
    with pytest.raises(BankError, match=r"build must be one of.*got 'none'"):
        build_bank(BankSpec(builds='average,none'))


def test_the_shipped_bank_is_the_one_that_is_drawn():
    drawn, shipped = build_bank(), default_bank()
    assert shipped.provenance == drawn.provenance
    assert shipped.fill == drawn.fill
    for ours, theirs in ((drawn, shipped), (drawn.finer, shipped.finer)):
        assert np.array_equal(ours.templates, theirs.templates)
        assert np.array_equal(ours.azimuth, theirs.azimuth)
        assert ours.builds == theirs.builds


def test_finer_views_are_the_same_walkers_in_more_directions_and_coarser():
    drawn = build_bank(BankSpec(azimuths=4, phases=4, builds='average,coat'))
    finer = drawn.finer
    assert finer.grid == (48, 32)
    assert (finer.phases, finer.fill) == (drawn.phases, drawn.fill)
    for sequence in range(drawn.sequences):
        away = np.abs(np.exp(1j * finer.azimuth) - np.exp(1j * drawn.azimuth[sequence]))
        same = [
            k for k, name in enumerate(finer.builds)
            if name == drawn.builds[sequence] and away[k] < 1e-5
        ]  # fmt: skip
        assert len(same) == 1
        full = drawn.templates[sequence].astype(float).reshape(4, 48, 2, 32, 2).mean((2, 4))
        assert np.abs(full - finer.templates[same[0]]).mean() < 2

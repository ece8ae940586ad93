# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given, strategies as st

from gait_segmentation.errors import BankError, ConfigError
from gait_segmentation.gait_model.builder import BankSpec, build_bank, model_digest, quantize

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
    assert len(done) == 8
    assert json.loads(bank.provenance['spec'])['phases'] == 6
    assert model_digest() in bank.provenance['model']


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


@given(st.integers(2, 256))
def test_quantize(levels):
    values = np.arange(256, dtype=np.uint8)
    once = quantize(values, levels)
    assert (quantize(once, levels) == once).all()
    assert len(np.unique(once)) == levels
    assert once[0] == 0
    assert once[255] == 255
    assert (np.diff(once.astype(int)) >= 0).all()
    assert np.abs(once.astype(int) - values).max() <= 255 / (levels - 1) / 2 + 1


def test_bad_specifications():
    with pytest.raises(ConfigError, match='phases must be an integer from 4 to 240, got 1'):
        BankSpec(phases=1)
    with pytest.raises(BankError, match=r"build must be one of.*got 'none'"):
        build_bank(BankSpec(builds='average,none'))

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import re

import numpy as np
import pytest

from gait_segmentation.errors import BankError
from gait_segmentation.gait_model.builder import BankSpec, build_bank
from gait_segmentation.gait_model.from_silhouettes import (
    SilhouetteSequence,
    bank_from_silhouettes,
)
from gait_segmentation.gait_model.render import render_silhouette

SPEC = BankSpec(height=48, width=32, phases=10)


@pytest.fixture(scope='module')
def masks():
    frames = [
        np.where(render_silhouette(0.6 + n / 30, np.pi, 80.0) >= 128, 255, 0) for n in range(72)
    ]
    return np.stack(frames).astype(np.uint8)


def tanimoto(first, second):
    first, second = first.astype(int), second.astype(int)
    return np.minimum(first, second).sum() / np.maximum(first, second).sum()


def test_the_bank_of_drawn_silhouettes_is_the_drawn_bank(masks):
    # The first contact comes at phase 1.0, which is the right leg's.
    bank = bank_from_silhouettes([SilhouetteSequence(masks, np.pi, 'walker')], SPEC)
    drawn = build_bank(BankSpec(height=48, width=32, phases=10, azimuths=2))
    assert bank.templates.shape == (1, 10, 48, 32)
    assert bank.builds == ('walker',)
    assert tanimoto(bank.templates[0], drawn.templates[1]) > 0.88
    assert re.search('step (14.9|15.0)', bank.provenance['sequences'])
    assert len(np.unique(bank.templates)) <= 8


def test_mirror(masks):
    bank = bank_from_silhouettes([SilhouetteSequence(masks, np.pi, 'walker')], SPEC, mirror=True)
    assert bank.azimuth == pytest.approx([np.pi, 0.0])
    half = np.roll(bank.templates[0], 5, axis=0)[:, :, ::-1]
    assert tanimoto(bank.templates[1], half) > 0.95


def test_the_leg_of_the_first_contact_shifts_by_half_a_stride(masks):
    right = bank_from_silhouettes([SilhouetteSequence(masks, np.pi, 'w')], SPEC)
    left = bank_from_silhouettes([SilhouetteSequence(masks, np.pi, 'w', 'left')], SPEC)
    assert tanimoto(left.templates[0], np.roll(right.templates[0], 5, axis=0)) > 0.95


def test_azimuths_are_wrapped(masks):
    bank = bank_from_silhouettes([SilhouetteSequence(masks, 5 * np.pi, 'walker')], SPEC)
    assert bank.azimuth[0] == pytest.approx(np.pi)


def test_bad_input(masks):
    with pytest.raises(BankError, match='at least one sequence'):
        bank_from_silhouettes([], SPEC)
    with pytest.raises(BankError, match=r'walker: .*fewer than three heel contacts'):
        bank_from_silhouettes([SilhouetteSequence(masks[:27], 0.0, 'walker')], SPEC)
    with pytest.raises(BankError, match=r'must be \(frames, height, width\) uint8'):
        SilhouetteSequence(masks[0], 0.0, 'walker')
    with pytest.raises(BankError, match="first_contact must be 'right' or 'left', got 'both'"):
        SilhouetteSequence(masks, 0.0, 'walker', 'both')
    with pytest.raises(BankError, match='azimuth must be a finite number'):
        SilhouetteSequence(masks, np.nan, 'walker')
    holed = masks.copy()
    holed[5] = 0
    with pytest.raises(BankError, match="silhouette 5 of 'walker' is empty"):
        SilhouetteSequence(holed, 0.0, 'walker')

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np

from gait_segmentation.matching.confidence import confidence, phase_evidence


def test_a_clear_phase_and_its_twin_are_trusted_more_than_a_flat_one():
    flat = np.zeros((2, 30), np.int16)
    clear = np.full((2, 30), -2000, np.int16)
    clear[1, [3, 18]] = 0
    low, high = (confidence(phase_evidence(scores, 1, 3)) for scores in (flat, clear))
    assert 0 <= low < 0.5 < 0.99 < high <= 1
    assert confidence(phase_evidence(clear, 1, 11)) < 0.01

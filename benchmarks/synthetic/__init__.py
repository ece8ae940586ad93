# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Made-up sequences with exact truth: walkers, what they wear, where they walk, what is about."""

from benchmarks.synthetic.camera import SyntheticConfig
from benchmarks.synthetic.sequence import SyntheticFrame, SyntheticSequence

__all__ = ['SyntheticConfig', 'SyntheticFrame', 'SyntheticSequence']

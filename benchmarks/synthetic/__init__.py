# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Made-up sequences with exact truth: walkers, what they wear, where they walk, what is about."""

from benchmarks.synthetic.sequence import SyntheticConfig, SyntheticFrame, SyntheticSequence

__all__ = ['SyntheticConfig', 'SyntheticFrame', 'SyntheticSequence']

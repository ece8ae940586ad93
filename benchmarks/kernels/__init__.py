# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
What the matcher's :class:`~gait_segmentation.matching.tanimoto.EventKernel` is measured against.

All give the same bits: :class:`ReferenceKernel` is the definition, and
:class:`DirectAccessTableKernel` the method of Wang, Yagi and Makihara (ACCV 2009).
"""

from benchmarks.kernels.direct_access_table import DirectAccessTableKernel
from benchmarks.kernels.reference import ReferenceKernel
from benchmarks.kernels.similarity import tanimoto

__all__ = ['DirectAccessTableKernel', 'ReferenceKernel', 'tanimoto']

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Tanimoto similarity of all templates with all windows of likelihood images, on integers.

Three kernels with one interface give the same bits: :class:`ReferenceKernel` is the definition,
:class:`DirectAccessTableKernel` the method of Wang, Yagi and Makihara (ACCV 2009), and
:class:`EventKernel` is what the matcher uses.
"""

from gait_segmentation.matching.tanimoto.direct_access_table import DirectAccessTableKernel
from gait_segmentation.matching.tanimoto.events import EventKernel, pitch_of, polyphase
from gait_segmentation.matching.tanimoto.reference import ReferenceKernel
from gait_segmentation.matching.tanimoto.similarity import tanimoto
from gait_segmentation.matching.tanimoto.windows import Kernel, WindowGrid

__all__ = [
    'DirectAccessTableKernel',
    'EventKernel',
    'Kernel',
    'ReferenceKernel',
    'WindowGrid',
    'pitch_of',
    'polyphase',
    'tanimoto',
]

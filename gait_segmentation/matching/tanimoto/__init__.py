# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Tanimoto similarity of all templates with all windows of likelihood images, on integers.

All :data:`KERNELS` give the same bits.
"""

from gait_segmentation.matching.tanimoto.direct_access_table import DirectAccessTableKernel
from gait_segmentation.matching.tanimoto.events import EventKernel
from gait_segmentation.matching.tanimoto.kernel import CommonAreas, pitch_of
from gait_segmentation.matching.tanimoto.reference import ReferenceKernel
from gait_segmentation.matching.tanimoto.windows import WindowGrid

__all__ = [
    'KERNELS',
    'CommonAreas',
    'DirectAccessTableKernel',
    'EventKernel',
    'ReferenceKernel',
    'WindowGrid',
    'pitch_of',
]

KERNELS: dict[str, type[CommonAreas]] = {
    'events': EventKernel,
    'direct_access_table': DirectAccessTableKernel,
    'reference': ReferenceKernel,
}
"""Those there are to choose from (``matching.kernel``)."""

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The templates of a bank as matchers need them, made once for all of them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.gait_model.builder import quantize
from gait_segmentation.matching.builds import BuildKernels, builds_of
from gait_segmentation.matching.evidence import FineEvidence
from gait_segmentation.matching.fine_views import FineViews
from gait_segmentation.matching.tanimoto import WindowGrid
from gait_segmentation.matching.visibility import LineSums

__all__ = ['CodedBank', 'coded_bank']


@dataclass(frozen=True)
class CodedBank:
    """
    What matchers derive from a bank.

    ``templates`` is (K, H, W) uint8 with few grey levels, ``sums`` are those of the kernels' rows.
    """

    templates: NDArray[np.uint8]
    kernels: BuildKernels
    sums: LineSums
    views: FineViews
    evidence: FineEvidence


def coded_bank(bank: TemplateBank, levels: int, windows: WindowGrid) -> CodedBank:
    """
    Return the templates of a bank for one matcher.

    Those of the last banks are kept: matchers share what they only read, and have memory of their
    own to work in, so that they can work at the same time.

    :param levels: grey levels of the templates.
    :param windows: where templates are laid.
    """
    shared = _coded(bank, levels, windows)
    return replace(shared, kernels=shared.kernels.copy(), evidence=shared.evidence.copy())


@lru_cache(maxsize=2)
def _coded(bank: TemplateBank, levels: int, windows: WindowGrid) -> CodedBank:
    templates = quantize(bank.templates, levels)
    kernels = BuildKernels(templates, builds_of(bank), windows)
    views = FineViews(bank)
    return CodedBank(
        templates.reshape(-1, *bank.grid),
        kernels,
        LineSums(templates, kernels.row, kernels.rows),
        views,
        FineEvidence(views, bank.fill),
    )

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

from pathlib import Path

import pytest

from gait_segmentation import colour, warping
from gait_segmentation.errors import BankError
from gait_segmentation.gait_model import extents
from gait_segmentation.matching import (
    MatchingConfig,
    backtrack,
    evidence_kernels,
    similarities,
    viterbi,
)
from gait_segmentation.matching.tanimoto import simd
from gait_segmentation.pipeline import PipelineConfig
from gait_segmentation.segmentation import (
    energy,
    graph_cut,
    refinement,
    shape_prior,
    thin_parts,
)
from gait_segmentation.starting import barrier, hypothesis
from gait_segmentation.tracking import background_kernels, cues, likelihood, resampling
from gait_segmentation.warm_up import open_bank, warm_up, warm_up_matcher
from test.walkers import small_bank


def test_afterwards_every_kernel_of_the_stages_is_compiled() -> None:
    warm_up(PipelineConfig(), small_bank())
    stages = (
        colour,
        simd,
        barrier,
        hypothesis,
        background_kernels,
        cues,
        likelihood,
        extents,
    )
    cuts = (energy, graph_cut, refinement, shape_prior, thin_parts)
    for module in stages + cuts:
        for name, kernel in vars(module).items():
            if not hasattr(kernel, 'signatures') or kernel.targetoptions.get('inline'):
                continue
            if kernel.__module__ == module.__name__:
                assert kernel.signatures, f'{module.__name__}.{name}'
    # Also what only a camera that turns fast calls.
    for kernel in (resampling._resample_runs, resampling._scale, warping._warp_runs):
        assert kernel.signatures


def test_the_matcher_has_then_been_hidden_cut_off_and_moved() -> None:
    warm_up_matcher(small_bank(), MatchingConfig())
    for module, names in (
        (similarities, ('_compare', '_compare_seen', '_compare_between_lines')),
        (viterbi, ('advance', 'shifted')),
        (backtrack, ('trace',)),
        (evidence_kernels, ('compare', 'pair')),
    ):
        for name in names:
            assert getattr(module, name).signatures, name


def test_a_bank_file_is_opened(tmp_path: Path) -> None:
    small_bank().save(tmp_path / 'bank.npz')
    assert open_bank(str(tmp_path / 'bank.npz')).templates.shape == small_bank().templates.shape
    with pytest.raises(BankError):
        open_bank(str(tmp_path / 'missing.npz'))

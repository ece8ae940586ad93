# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Parameters of the segmentation stage."""

from __future__ import annotations

from dataclasses import dataclass

from gait_segmentation.config import StageConfig, parameter


@dataclass(frozen=True)
class SegmentationConfig(StageConfig):
    """Parameters of the segmentation stage; lengths are in body heights."""

    prior: str = parameter(
        'default',
        'Shape prior: none (likelihood and contrast only), default (log-odds that grow with the '
        "distance from the template's outline), paper (the paper's oriented shape prior, as read "
        'here).',
        choices=('none', 'default', 'paper'),
    )
    contrast: float = parameter(
        2.0,
        'Weight of the contrast term: raising it makes outlines shorter and lets them follow '
        'image edges.',
        minimum=0.0,
        maximum=100.0,
    )
    template_weight: float = parameter(
        0.5,
        'Weight of the template in the data term.',
        minimum=0.0,
        maximum=5.0,
    )
    template_slope: float = parameter(
        0.025,
        "Distance from the template's outline over which its log-odds change by one.",
        minimum=0.002,
        maximum=0.5,
    )
    fit_low: float = parameter(
        0.65,
        'How well templates explain the likelihood, over how well the masks do, up to which the '
        'prior has no weight: who dances or bends is no template.',
        minimum=0.0,
        maximum=1.0,
    )
    fit_high: float = parameter(
        0.8,
        'The same from which on the prior has its full weight; not above fit_low: it always has.',
        minimum=0.0,
        maximum=1.0,
    )
    use_support: bool = parameter(
        True, 'Drop parts of the cut that neither template nor likelihood supports: passers-by.'
    )
    use_refinement: bool = parameter(
        True, 'Cut again at full resolution in a narrow band about the outline.'
    )
    vocabulary: str = parameter(
        '',
        "File of the paper prior's vocabulary, made by gait_bank vocabulary; empty: the shipped "
        'one.',
        fixed=True,
    )
    paper_weight: float = parameter(
        2.0,
        'Weight of the paper prior on the n-links: raising it pulls the outline to the template.',
        minimum=0.0,
        maximum=100.0,
    )
    paper_reach: float = parameter(
        0.2,
        "Distance outside of the template's outline at which the paper prior's term is full; what "
        'is farther is background.',
        minimum=0.005,
        maximum=0.5,
    )
    paper_depth: float = parameter(
        0.04,
        "The same inside of the template's outline, since limbs are thin.",
        minimum=0.005,
        maximum=0.5,
    )
    paper_orientation: float = parameter(
        1.0,
        "How much further away an image edge of a wrong orientation counts; 0: Freedman-Zhang's "
        'distance.',
        minimum=0.0,
        maximum=100.0,
    )
    paper_search: float = parameter(
        0.01,
        "How far the local search looks for less of the paper prior's distance (at least one "
        'pixel).',
        minimum=0.0,
        maximum=0.2,
    )
    paper_edge_factor: float = parameter(
        0.8,
        'Factor on the paper prior where no image edge confirms the outline.',
        minimum=0.0,
        maximum=1.0,
    )

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The gait model: kinematics, a body, its silhouettes, and the bank of templates.

Banks
    :func:`default_bank` is the standard bank, :func:`build_bank` makes another one from a
    :class:`BankSpec`, :func:`cached_bank` does the same and keeps it in the user's cache folder.

Single pictures of a walker
    ``render_silhouette(phase, azimuth, height_px, **options) -> (rows, columns) uint8`` is an
    anti-aliased alpha channel; ``render_parts(...)``, with the same parameters, ``-> dict[str,
    (rows, columns) uint8]`` has one alpha channel for each of :data:`PARTS` (``'head'``,
    ``'torso'``, ``'skirt'``, ``'rucksack'``, ``'arms'``, ``'hands'``, ``'legs'``, ``'feet'``).
    The options (``build``, ``elevation``, ``fill``, ``shift``) are those of
    :class:`~gait_segmentation.gait_model.render.Drawing`.
"""

from __future__ import annotations

from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.gait_model.body import BUILDS, FIGURES, PARTS, Build
from gait_segmentation.gait_model.builder import (
    BankSpec,
    build_bank,
    cached_bank,
    default_bank,
    open_bank,
)
from gait_segmentation.gait_model.render import render_parts, render_silhouette

__all__ = [
    'BUILDS',
    'FIGURES',
    'PARTS',
    'BankSpec',
    'Build',
    'TemplateBank',
    'build_bank',
    'cached_bank',
    'default_bank',
    'open_bank',
    'render_parts',
    'render_silhouette',
]

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The gait model: kinematics, a body, its silhouettes, and banks of them.

:func:`build_bank` draws a bank from a :class:`BankSpec`.  Single pictures of a walker:
``render_silhouette(phase, azimuth, height_px, **options) -> (rows, columns) uint8`` is an
anti-aliased alpha channel; ``render_parts(...)``, with the same parameters, ``-> dict[str, (rows,
columns) uint8]`` has one alpha channel for each of :data:`PARTS` (``'head'``, ``'torso'``,
``'skirt'``, ``'rucksack'``, ``'arms'``, ``'hands'``, ``'legs'``, ``'feet'``).  The options
(``build``, ``elevation``, ``fill``, ``shift``) are those of
:class:`~gait_tools.gait_model.render.Drawing`.
"""

from gait_tools.gait_model.body import BUILDS, FIGURES, PARTS, Build
from gait_tools.gait_model.builder import BankSpec, build_bank
from gait_tools.gait_model.render import render_parts, render_silhouette

__all__ = [
    'BUILDS',
    'FIGURES',
    'PARTS',
    'BankSpec',
    'Build',
    'build_bank',
    'render_parts',
    'render_silhouette',
]

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The gait model: kinematics, a body, its silhouettes (see ``Drawing``), and banks of them."""

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

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The commands; see :mod:`gait_segmentation.commands`, which imports little as well."""

from functools import partial

from gait_segmentation.commands import run_tool

__all__ = ['bank', 'demo', 'evaluate', 'figures', 'source']

bank = partial(run_tool, 'bank', 'gait_tools')
demo = partial(run_tool, 'demo', 'gait_tools')
evaluate = partial(run_tool, 'evaluate', 'gait_tools')
figures = partial(run_tool, 'figures', 'gait_tools')
source = partial(run_tool, 'source', 'gait_tools')

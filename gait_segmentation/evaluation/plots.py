# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Plots of an evaluation (these need matplotlib)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gait_segmentation.errors import SequenceError
from gait_segmentation.files.output_files import writing

__all__ = ['plot_priors']


def plot_priors(path: Path, reports: Mapping[str, Mapping[str, Any]]) -> None:
    """
    Draw the error rate of each prior on each sequence as bars, the mean last.

    :param path: of the PNG file.
    :param reports: prior -> report.
    :raises SequenceError: if matplotlib is missing or the file cannot be written.
    """
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as error:
        raise SequenceError(f'{path} needs matplotlib to be drawn: {error}') from error
    names = [*next(iter(reports.values()))['sequences'], 'mean']
    figure = Figure(figsize=(1.8 + 1.1 * len(names), 3.6), dpi=120, layout='constrained')
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    width = 0.8 / len(reports)
    for place, (prior, report) in enumerate(reports.items()):
        numbers = {**report['sequences'], 'mean': report['mean']}
        left = [index - 0.4 + (place + 0.5) * width for index in range(len(names))]
        bars = axes.bar(left, [numbers[name]['error_rate'] for name in names], width, label=prior)
        axes.bar_label(bars, fmt='%.2f', fontsize=6, padding=1)
    axes.set_xticks(range(len(names)), names)
    axes.axvline(len(names) - 1.5, color='0.8', linewidth=1)
    axes.set_ylabel('missegmented pixels in the window [%]')
    axes.spines[['top', 'right']].set_visible(False)
    axes.legend(
        title='shape prior',
        frameon=False,
        ncols=len(reports),
        loc='lower left',
        bbox_to_anchor=(0, 1),
    )
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path)

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which part of the method does what: priors compared, ingredients left out one by one."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gait_segmentation.config import parameters_of, replaced, stages_of
from gait_segmentation.errors import SequenceError
from gait_segmentation.evaluation.report import aligned
from gait_segmentation.evaluation.session import Session
from gait_segmentation.files.output_files import writing

__all__ = ['compare_priors', 'ingredient_table', 'leave_one_out', 'plot_priors', 'prior_table']


def compare_priors(
    session: Session, config: Any, base: Mapping[str, Any]
) -> dict[str, dict[str, Any]]:
    """
    Evaluate every shape prior there is, everything else as configured.

    :param base: the report of ``config`` itself, not run again.
    :returns: prior -> report.
    """
    reports = {}
    about = {a.name: a for a in parameters_of(config.segmentation)}['prior']
    for prior in about.choices or ():
        if prior == config.segmentation.prior:
            reports[prior] = dict(base)
        else:
            changed = replaced(config, 'segmentation', 'prior', prior)
            reports[prior] = session.evaluate(changed, name=prior)
    return reports


def leave_one_out(session: Session, config: Any) -> dict[str, dict[str, Any]]:
    """
    Switch off each ``use_...`` parameter that is on, one at a time.

    :returns: ``stage.parameter`` -> report.
    """
    reports = {}
    for stage, values in stages_of(config).items():
        for about in parameters_of(values):
            if (
                about.type is bool
                and about.name.startswith('use_')
                and getattr(values, about.name)
            ):
                name = f'{stage}.{about.name}'
                changed = replaced(config, stage, about.name, False)
                reports[name] = session.evaluate(changed, name=f'no {name}')
    return reports


def prior_table(reports: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the means of each prior as an aligned table."""
    restarts = any('restarts' in report for report in reports.values())
    rows = [['prior', 'error %', 'J', 'F'] + (['restart J'] if restarts else [])]
    for prior, report in reports.items():
        mean = report['mean']
        row = [prior, f'{mean["error_rate"]:.2f}', f'{mean["J"]:.4f}', f'{mean["F"]:.4f}']
        rows.append(row + ([_number(report['restarts']['J'], '.4f')] if restarts else []))
    return aligned(rows)


def ingredient_table(base: Mapping[str, Any], reports: Mapping[str, Mapping[str, Any]]) -> str:
    """
    Return what the means lose without each ingredient as an aligned table, worst loss first.

    The last column names the sequence that loses most.
    """
    restarts = 'restarts' in base
    header = ['without', 'J', 'delta J'] + (['restart J', 'delta'] if restarts else [])
    mean = base['mean']
    first = ['(nothing left out)', f'{mean["J"]:.4f}', '']
    rows = [[*header, 'who suffers']]
    rows.append(first + ([_number(base['restarts']['J'], '.4f'), ''] if restarts else []) + [''])
    for name, report in sorted(reports.items(), key=lambda item: item[1]['mean']['J']):
        row = [name, f'{report["mean"]["J"]:.4f}', f'{report["mean"]["J"] - mean["J"]:+.4f}']
        if restarts:
            again, before = report['restarts']['J'], base['restarts']['J']
            delta = None if again is None or before is None else again - before
            row += [_number(again, '.4f'), _number(delta, '+.4f')]
        rows.append([*row, _worst(base, report)])
    return aligned(rows)


def _number(value: float | None, digits: str) -> str:
    return '-' if value is None else format(value, digits)


def _worst(base: Mapping[str, Any], report: Mapping[str, Any]) -> str:
    changes = {
        name: numbers['J'] - base['sequences'][name]['J']
        for name, numbers in report['sequences'].items()
    }
    name = min(changes, key=lambda key: changes[key])
    return f'{name} {changes[name]:+.3f}'


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

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which part of the method does what: priors compared, ingredients left out one by one."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gait_segmentation.config import parameters_of, replaced, stages_of
from gait_tools.evaluation.report import aligned, write_figure
from gait_tools.evaluation.session import Session


def priors(config: Any) -> dict[str, Any]:
    """Return a pipeline's configuration with each shape prior there is."""
    about = {about.name: about for about in parameters_of(config.segmentation)}['prior']
    return {
        prior: replaced(config, 'segmentation', 'prior', prior) for prior in about.choices or ()
    }


def ingredients(config: Any) -> dict[str, Any]:
    """Return it without each ``use_...`` parameter that is on, by ``stage.parameter``."""
    return {
        f'{stage}.{about.name}': replaced(config, stage, about.name, False)
        for stage, values in stages_of(config).items()
        for about in parameters_of(values)
        if about.type is bool and about.name.startswith('use_') and getattr(values, about.name)
    }


ABLATIONS = {'priors': priors, 'ingredients': ingredients}
"""What makes the configurations to compare of the one that is used."""


def compare(
    session: Session, config: Any, base: Mapping[str, Any], ablation: str
) -> dict[str, dict[str, Any]]:
    """
    Evaluate the configurations of an ablation.

    :param base: the report of ``config`` itself, not run again.
    :param ablation: one of :data:`ABLATIONS`.
    :returns: the reports by name.
    """
    return {
        name: dict(base) if changed == config else session.evaluate(changed, name=name)
        for name, changed in ABLATIONS[ablation](config).items()
    }


def comparison_table(
    title: str, base: Mapping[str, Any], reports: Mapping[str, Mapping[str, Any]]
) -> str:
    """
    Return the means, and what they lose against a base, as an aligned table, worst loss first.

    The last column names the sequence that loses most.

    :param title: of the names.
    """
    again = 'restarts' in base
    rows = [
        [title, 'error %', 'J', 'F', 'delta J', *(['restart J'] if again else []), 'who suffers']
    ]
    for name, report in sorted(reports.items(), key=lambda item: item[1]['mean']['J']):
        mean = report['mean']
        row = [name, f'{mean["error_rate"]:.2f}', f'{mean["J"]:.4f}', f'{mean["F"]:.4f}']
        row.append(f'{mean["J"] - base["mean"]["J"]:+.4f}')
        if again:
            j = report['restarts']['J']
            row.append('-' if j is None else f'{j:.4f}')
        rows.append([*row, _worst(base, report)])
    return aligned(rows)


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
    :raises SequenceError: if the file cannot be written.
    """
    # Here, since it takes long to load.
    from matplotlib.figure import Figure

    names = [*next(iter(reports.values()))['sequences'], 'mean']
    figure = Figure(figsize=(1.8 + 1.1 * len(names), 3.6), dpi=120, layout='constrained')
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
    write_figure(path, figure)

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``gait_evaluate``: score the pipeline on sequences with ground truth."""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from typing import Any

import cv2
from tqdm import tqdm

from gait_segmentation.errors import GaitSegmentationError
from gait_segmentation.evaluation.report import (
    Summary,
    mean_of,
    restart_report,
    table,
    write_json,
)
from gait_segmentation.evaluation.runner import (
    check_truth,
    run_restarts,
    run_sequence,
)
from gait_segmentation.evaluation.sequence import Sequence
from gait_segmentation.evaluation.settings import overridden

__all__ = ['main', 'parser']


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    made = argparse.ArgumentParser(
        prog='gait_evaluate',
        description='Run the pipeline over sequences with ground truth, every frame in lockstep '
        'from the first box on, and score the masks.',
    )
    made.add_argument('sequence', nargs='+', type=Path)
    made.add_argument('--prior')
    made.add_argument('--set', action='append', default=[], metavar='STAGE.PARAM=VALUE')
    made.add_argument('--restarts', action='store_true')
    made.add_argument('--likelihood', default='', metavar='NAME')
    made.add_argument('--json', type=Path, metavar='FILE')
    made.add_argument('--threads', type=int, default=1)
    return made


def main(arguments: list[str] | None = None) -> int:
    """Run the command and return its exit code."""
    options = parser().parse_args(arguments)
    try:
        evaluate(options)
    except GaitSegmentationError as error:
        print(f'gait_evaluate: error: {error}', file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print('gait_evaluate: interrupted', file=sys.stderr)
        return 130
    return 0


def evaluate(options: argparse.Namespace) -> None:
    """Run everything asked for."""
    from gait_segmentation.pipeline import Pipeline, PipelineConfig

    cv2.setNumThreads(options.threads)
    settings = list(options.set)
    if options.prior is not None:
        settings.insert(0, f'segmentation.prior={options.prior}')
    config = overridden(PipelineConfig(), settings)
    sequences = [Sequence.load(folder) for folder in options.sequence]
    for sequence in sequences:
        check_truth(sequence)

    def make() -> Any:
        return Pipeline(config, clock=time.perf_counter)

    rows, starts = {}, {}
    for sequence in sequences:
        summary = Summary()
        for outcome in tqdm(
            run_sequence(
                make(), sequence, clock=time.perf_counter, likelihood_name=options.likelihood
            ),
            desc=sequence.name,
            total=len(sequence.numbers),
            unit='frame',
            disable=None,
            leave=False,
        ):
            summary.add(outcome)
        rows[sequence.name] = summary.numbers()
        if options.restarts:
            starts[sequence.name] = list(run_restarts(make, sequence, clock=time.perf_counter))
    report: dict[str, Any] = {'sequences': rows, 'mean': mean_of(rows)}
    if options.restarts:
        report['restarts'] = restart_report(starts)
    print(table(report))
    if options.json is not None:
        write_json(options.json, report)


if __name__ == '__main__':
    sys.exit(main())

#!/usr/bin/env python3
# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The shape priors by themselves: cuts of the same likelihoods and matches, without feedback.

The pipeline runs once over each sequence.  Its tracker's likelihoods and its matcher's templates
are kept, and every frame is segmented again with each prior, so that no mask teaches the tracker
anything.  Prints the wrong pixels in percent of the window, ambiguous ones left out.  Usage::

    python benchmarks/fixed_likelihood.py SEQUENCE_DIR ... [--set STAGE.PARAM=VALUE] [--json FILE]

``--set`` changes a parameter of all that is run, so that ``segmentation.prior=none`` takes the
likelihoods of a pipeline without a prior.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
from pathlib import Path

import cv2

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from gait_segmentation.cli.tool import run_tool
from gait_segmentation.config import overridden, parameters_of, replaced
from gait_segmentation.kernels import compile_kernels
from gait_segmentation.pipeline import Pipeline, PipelineConfig
from gait_segmentation.segmentation import PeopleSegmenter
from gait_tools.evaluation.metrics import error_percent, evaluation_window
from gait_tools.evaluation.report import aligned
from gait_tools.evaluation.sequence import Sequence
from gait_tools.evaluation.session import load_sequences


def measure(sequence: Sequence, config: PipelineConfig, priors: tuple[str, ...]) -> list[float]:
    """Return the mean error of each prior."""
    pipeline = Pipeline(config)
    segmenters = [
        PeopleSegmenter(replaced(config, 'segmentation', 'prior', prior).segmentation)
        for prior in priors
    ]
    errors: list[list[float]] = [[] for _ in priors]
    for number in sequence.numbers:
        for box in sequence.starts.get(number, ())[:1]:
            pipeline.initialize(box)
        image, truth = sequence.image(number), sequence.truth(number)
        (result,) = pipeline.update(image, sequence.stamp_ns(number))
        (person,) = result.people
        for segmenter, found in zip(segmenters, errors, strict=True):
            mask = segmenter.update(image, [person.track.likelihood], [person.match]).mask
            if truth is not None:
                window = evaluation_window(truth)
                found.append(error_percent(mask[window], truth[window]))
    return [statistics.fmean(each) for each in errors]


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument('sequence', type=Path, nargs='+', metavar='SEQUENCE_DIR')
    parser.add_argument('--set', action='append', default=[], metavar='STAGE.PARAM=VALUE')
    parser.add_argument('--json', type=Path, metavar='FILE', help='write the figures here')
    options = parser.parse_args()
    cv2.setNumThreads(1)
    settings = ['starting.auto_init=none', 'people.max_people=1', *options.set]
    config = overridden(PipelineConfig(), settings)
    about = {each.name: each for each in parameters_of(config.segmentation)}['prior']
    priors = about.choices or ()
    sequences = load_sequences(options.sequence)
    compile_kernels()
    report = {each.name: measure(each, config, priors) for each in sequences}
    report['mean'] = [statistics.fmean(each) for each in zip(*report.values(), strict=True)]
    rows = [[name, *(f'{error:.2f}' for error in errors)] for name, errors in report.items()]
    print(aligned([['error %', *priors], *rows]))
    plain = priors.index('none')
    for place, prior in enumerate(priors):
        if place != plain:
            lower = sum(report[each.name][place] < report[each.name][plain] for each in sequences)
            ratio = report['mean'][place] / report['mean'][plain]
            print(f'{prior}: lower than none on {lower} of {len(sequences)}, means {ratio:.3f}')
    if options.json:
        named = {name: dict(zip(priors, each, strict=True)) for name, each in report.items()}
        options.json.write_text(json.dumps(named, indent=1) + '\n')


if __name__ == '__main__':
    sys.exit(run_tool('fixed_likelihood.py', main))

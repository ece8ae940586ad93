# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``gait_figures``: draw from a clip what the figures of the paper show."""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path

import cv2

from gait_segmentation.cli.tool import (
    add_config_options,
    command_parser,
    make_folder,
    preset_file,
    run_tool,
)
from gait_segmentation.config import overridden, replaced
from gait_segmentation.files.output_files import keep_apart, write_file, writing
from gait_segmentation.geometry import Box
from gait_tools.evaluation.report import write_image
from gait_tools.figures.walk import figured, open_walk, record

__all__ = ['FILES', 'main', 'parser']

FILES = ('table.png', 'frames.png', 'phase.png', 'errors.png', 'errors.md')
"""What is written: Fig. 1, Figs. 2 and 3, Fig. 4, and Table 1 twice."""

DESCRIPTION = """\
Draw from a clip what the figures of Wang, Yagi and Makihara (ACCV 2009) show.

  table.png   Fig. 1: the direct access table of one pixel
  frames.png  Figs. 2 and 3: tracked box (red) and refined box (green),
              likelihood, gait model at its place, mask
  phase.png   Fig. 4: the phase of each frame alone, and of the best path
  errors.png  Table 1: wrong pixels with and without the shape prior, ambiguous
  errors.md   ones left out; only of clips with truth
"""

EPILOG = """\
examples
  gait_figures                           # the clip of the repository, in its folder
  gait_figures --preset paper --out out/paper
  gait_figures walk.mp4 --box 400 120 80 260
"""


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    made = command_parser('gait_figures', DESCRIPTION, EPILOG)
    add = made.add_argument
    add(
        'clip',
        nargs='?',
        type=Path,
        default=Path('examples/walker'),
        metavar='CLIP',
        help='a sequence folder as of gait_evaluate, or a film, a folder of images or a bag '
        '(default: %(default)s)',
    )
    add(
        '--box',
        nargs=4,
        type=float,
        metavar=('X', 'Y', 'WIDTH', 'HEIGHT'),
        help='tight about the person in the first frame, in pixels; a sequence folder has one',
    )
    add(
        '--out',
        type=Path,
        default=Path('out/figures'),
        metavar='DIR',
        help='folder of the pictures (default: %(default)s)',
    )
    add_config_options(made)
    return made


def main(arguments: list[str] | None = None) -> int:
    """Run the command and return its exit code."""
    return run_tool('gait_figures', lambda: draw(parser().parse_args(arguments)))


def draw(options: argparse.Namespace) -> None:
    """
    Run the pipeline with and without a prior, and draw.

    :raises GaitSegmentationError: if an option, the clip or a file cannot be used.
    """
    box = None if options.box is None else Box(*options.box)
    walk = open_walk(options.clip, box)
    keep_apart([('--out', options.out / name) for name in FILES], [options.clip])
    make_folder('--out', options.out)
    # Here, so that --help does not wait for the kernels to be loaded.
    from gait_segmentation.cli.settings import Settings, read_parameter_file
    from gait_segmentation.kernels import compile_kernels, compiling
    from gait_segmentation.pipeline import Pipeline, PipelineConfig
    from gait_tools.figures.access_table import draw_access_table, table_of
    from gait_tools.figures.errors import draw_errors, errors_of, errors_table
    from gait_tools.figures.frames import chosen, draw_frames
    from gait_tools.figures.phases import draw_phases, phases_of

    cv2.setNumThreads(1)
    config = PipelineConfig()
    if options.preset is not None:
        config = read_parameter_file(preset_file(options.preset), Settings(config)).config
    config = figured(overridden(config, options.set))
    with compiling(lambda text: print(f'gait_figures: {text}', file=sys.stderr)):
        compile_kernels()
    pipeline = Pipeline(config)
    shots, bank = record(pipeline, walk), pipeline.bank
    shown = chosen(shots)
    middle = shown[len(shown) // 2]
    table = table_of(middle, bank, config.matching)
    degrees = math.degrees(float(bank.azimuth[middle.match.sequence]))
    write_image(options.out / 'table.png', draw_access_table(table, middle.given.number, degrees))
    write_image(options.out / 'frames.png', draw_frames(shown, bank.phases))
    phases = phases_of(shots, bank, config.matching)
    write_image(options.out / 'phase.png', draw_phases(phases))
    for words, each in (('each frame alone', phases.alone), ('best path', phases.path)):
        error = phases.rms(each)
        about = '' if math.isnan(error) else f', RMS {error:.1f} % of the whole stride'
        print(f'phase, {words}: {phases.backward(each):.0f} % of the steps go back{about}')
    with_prior = errors_of(shots)
    if with_prior is None:
        print('no table of errors: the clip has no masks')
        return
    bare = replaced(config, 'segmentation', 'prior', 'none')
    without = errors_of(record(Pipeline(bare), walk))
    assert without is not None
    text = errors_table(walk.name, without, with_prior)
    print(f'\n{text}', end='')
    path = options.out / 'errors.md'
    with writing(path):
        write_file(path, text.encode())
    write_image(options.out / 'errors.png', draw_errors(without, with_prior))


if __name__ == '__main__':
    sys.exit(main())

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
    READING,
    add_config_options,
    add_reading_options,
    command_parser,
    preset_file,
    run_tool,
)
from gait_segmentation.config import overridden, replaced
from gait_segmentation.files import keep_apart
from gait_segmentation.geometry import Box
from gait_tools.figures.walk import figured, open_walk
from gait_tools.outputs import is_own_picture, keep_others, make_folder, write_figure

FILES = ('table.png', 'frames.png', 'phase.png', 'prior.png')
"""What is written: Fig. 1, Figs. 2 and 3, Fig. 4, and section 4."""

DESCRIPTION = """\
Draw from a clip what the figures of Wang, Yagi and Makihara (ACCV 2009) show.

  table.png   Fig. 1: the direct access table of one pixel
  frames.png  Figs. 2 and 3: tracked box (red), the same where the path has it
              (green: the paper's refined box), box about what is likely there
              (yellow, dashed), likelihood, gait model at its place, mask
  phase.png   Fig. 4: the phase of each frame alone, and of the best path
  prior.png   section 4: how the paper's shape prior is made in one frame, also if
              the parameters ask for another prior

Prints Table 1 of clips with truth: wrong pixels with and without the shape prior,
ambiguous ones left out.
"""

EPILOG = """\
examples
  gait_figures                           # the clip of the repository, in its folder
  gait_figures --preset paper --out out/paper
  gait_figures walk.mp4 --box 400 120 80 260
  gait_figures walk.mp4 --box 1260 519 133 414 --start 70 --count 120 --width 960
"""


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    made = command_parser('gait_figures', DESCRIPTION, EPILOG)
    add = made.add_argument
    words = 'a sequence folder as of gait_evaluate, or a film, a folder of images or a bag '
    words += '(default: %(default)s)'
    add('clip', nargs='?', type=Path, default=Path('examples/walker'), metavar='CLIP', help=words)
    add(
        '--box',
        nargs=4,
        type=float,
        metavar=('X', 'Y', 'WIDTH', 'HEIGHT'),
        help='tight about the person in the first frame read, in pixels of the film; a sequence '
        'folder has one',
    )
    words = 'folder of the pictures (default: %(default)s)'
    add('--out', type=Path, default=Path('out/figures'), metavar='DIR', help=words)
    add_config_options(made)
    add_reading_options(made, 'films: their own; folders: 30')
    return made


def main(arguments: list[str] | None = None) -> int:
    """Run the command and return its exit code."""
    return run_tool('gait_figures', lambda: draw(parser().parse_args(arguments)))


def draw(options: argparse.Namespace) -> None:
    """Run the pipeline with and without a prior, and draw."""
    box = None if options.box is None else Box(*options.box)
    given = {name: getattr(options, name) for name in READING}
    usual = parser().get_default
    walk = open_walk(
        options.clip, box, **{name: each for name, each in given.items() if each != usual(name)}
    )
    keep_apart([('--out', options.out / name) for name in FILES], [options.clip])
    keep_others([('--out', options.out / name, is_own_picture) for name in FILES], 'gait_figures')
    make_folder('--out', options.out)
    # Here, so that --help does not wait for the kernels to be loaded.
    from gait_segmentation.cli.tool import Settings, read_parameter_file
    from gait_segmentation.kernels import compile_kernels, compiling
    from gait_segmentation.pipeline import Pipeline, PipelineConfig
    from gait_segmentation.segmentation.segmenter import vocabulary_of
    from gait_tools.figures.pictures import (
        chosen,
        draw_access_table,
        draw_frames,
        draw_phases,
        table_of,
    )
    from gait_tools.figures.prior import draw_prior, steps_of
    from gait_tools.figures.walk import mean_scores, phases_of, record

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
    figure = draw_access_table(table, middle.given.number, degrees)
    write_figure(options.out / 'table.png', figure)
    write_figure(options.out / 'frames.png', draw_frames(shown, bank.phases))
    phases = phases_of(shots, bank, config.matching)
    write_figure(options.out / 'phase.png', draw_phases(phases))
    segmentation = config.segmentation
    steps = steps_of(middle, segmentation, vocabulary_of(segmentation))
    if steps is None:
        print('no prior.png: the template has no outline in the image')
    else:
        figure = draw_prior(steps, middle.given.number, segmentation)
        write_figure(options.out / 'prior.png', figure)
    for words, each in (('each frame alone', phases.alone), ('best path', phases.path)):
        error = phases.rms(each)
        about = '' if math.isnan(error) else f', RMS {error:.1f} % of the whole stride'
        print(f'phase, {words}: {phases.backward(each):.0f} % of the steps go back{about}')
    with_prior = mean_scores(shots)
    if with_prior is None:
        print('no table of errors: the clip has no masks')
        return
    bare = replaced(config, 'segmentation', 'prior', 'none')
    without = mean_scores(record(Pipeline(bare), walk))
    assert without is not None
    cells = ' | '.join(f'{error:.2f} % / {j:.3f}' for _, error, j in (without, with_prior))
    print('\n| clip | frames | error / J without the shape prior | with it |\n|---|---|---|---|')
    print(f'| {walk.name} | {with_prior[0]} | {cells} |')


if __name__ == '__main__':
    sys.exit(main())

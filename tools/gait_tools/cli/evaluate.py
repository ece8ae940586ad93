# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``gait_evaluate``: score the pipeline on sequences with ground truth."""

from __future__ import annotations

import argparse
import json
import os
import re
import sys
import time
from functools import partial
from pathlib import Path

import cv2

from gait_segmentation.cli.tool import (
    PROCESSORS,
    add_config_options,
    check_ranges,
    command_parser,
    preset_file,
    run_tool,
)
from gait_segmentation.config import overridden
from gait_segmentation.errors import ConfigError
from gait_segmentation.files import keep_apart
from gait_tools.evaluation.ablation import SPOILT, ablate
from gait_tools.evaluation.report import place_table, table, tracking_table
from gait_tools.evaluation.session import Session, load_sequences
from gait_tools.outputs import (
    check_file,
    is_own_picture,
    keep_others,
    make_folder,
    with_part,
    write,
    write_json,
)

_OUTPUT = Path('-')
_SCORES = re.compile(rb'\{\s*"sequences": \{')  # beginning of a file of scores
DESCRIPTION = """\
Run the pipeline over sequences with ground truth and score the masks and tracks.

The pipeline gets each person's first box once (or none, --init auto) and then
every frame in order, in lockstep, so that two runs give the same masks to the
bit.
"""

EPILOG = """\
a sequence is a folder with
  frames/NNNN.png     the images (png, jpg, bmp, ...), named by number, which a
                      name may precede (frame_0007.png)
  masks/NNNN.png      the truth: 255 person, 0 background, any other value
                      ambiguous (left out of every score); frames without a
                      mask are run but not scored
  sequence.yaml       fps, initial_box: [x, y, width, height], initial_frame
and, where several people are labelled,
  labels/NNNN.png     0 nobody, 1 to 16 one person each, 255 ambiguous; there
                      are then as many slots as people (unless --set says
                      people.max_people); people start from the initial_boxes
                      of sequence.yaml ([{frame: N, box: [x, y, w, h]}, ...]),
                      or else from their true box in the first frame that
                      shows all of them

docs/evaluation.md says what the columns of the tables are.

examples
  gait_evaluate data/hall data/lucia --json scores.json
  gait_evaluate data/hall --json - | jq .mean.J
  gait_evaluate data/* --out out/eval --warm
  gait_evaluate data/* --preset paper --prior none
  gait_evaluate data/* --ablate mechanisms --out out/ablation --boxes 3 --jobs 2
  gait_evaluate data/hall --set segmentation.contrast=3 --bank mine.npz
  gait_evaluate data/hall --init auto --set people.max_people=1
"""


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    made = command_parser('gait_evaluate', DESCRIPTION, EPILOG)
    add = made.add_argument
    add('sequence', nargs='+', type=Path, metavar='SEQUENCE_DIR', help='sequence folders')
    add(
        '--init',
        choices=('box', 'auto'),
        default='box',
        help='how people get a track: from boxes of the ground truth, or found by the pipeline '
        'itself, with 3 slots at least if it is given heat maps, which show everybody at once, '
        'unless --set says people.max_people (default: %(default)s)',
    )
    add_config_options(made)
    add('--prior', help='shape prior of the segmentation, e.g. none or default')
    add('--bank', metavar='FILE', help='template bank, as gait_bank writes it')
    add(
        '--warm',
        action='store_true',
        help='also give the box at every 10th frame to a camera that has been running since the '
        "clip's first frame, and score 14 frames: J of all, J0 of the first",
    )
    add(
        '--heat-map',
        default='',
        metavar='NAME[:LATE[:EVERY]]',
        help='take SEQUENCE_DIR/NAME/NNNN.png (grey, any size) as heat maps beside the '
        "tracker's own likelihood; frames may go without; maps come LATE frames after theirs (0), "
        'with every EVERYth frame (1)',
    )
    words = 'write all numbers to a file; - = to standard output (tables then to standard error)'
    add('--json', type=Path, metavar='FILE', help=words)
    words = 'write DIR/NAME/masks/NNNN.png and DIR/NAME/contact_sheet.png (found: green, true: '
    words += 'magenta, without its ambiguous rim)'
    add('--out', type=Path, metavar='DIR', help=words)
    add = made.add_argument_group('what each mechanism is worth').add_argument
    add(
        '--ablate',
        choices=('mechanisms',),
        help='leave out one at a time, and print a table of what that does to J; --out keeps the '
        'results, from which a run that was stopped goes on (other code: another DIR)',
    )
    boxes = 'also run films from N - 1 boxes moved by up to 4 %% of their height (default: 1)'
    add('--boxes', type=int, default=1, metavar='N', help=boxes)
    add('--jobs', type=int, default=1, metavar='N', help='processes (default: 1)')
    spoil = 'also run what is for them on films that are spoilt so, see docs/evaluation.md'
    add('--spoil', nargs='+', choices=SPOILT, default=[], help=spoil)
    write = 'put the table between <!-- mechanisms --> and <!-- end --> in a Markdown file'
    add('--write', type=Path, metavar='FILE', help=write)
    return made


def main(arguments: list[str] | None = None) -> int:
    """Run the command and return its exit code."""
    return run_tool('gait_evaluate', lambda: evaluate(parser().parse_args(arguments)))


def evaluate(options: argparse.Namespace) -> None:
    """Run, print and write everything that is asked for."""
    _keep_inputs(options)
    check_ranges(options, {'jobs': PROCESSORS, 'boxes': (1, 1000)})
    if options.ablate is not None:
        if options.out is None or options.json or options.warm:
            raise ConfigError('--ablate needs --out, and goes without --json and --warm')
        if options.write is not None:
            with_part(options.write, options.ablate, '')
    if options.json != _OUTPUT:
        keep_others(
            [('--json', options.json, lambda head: bool(_SCORES.match(head)))], 'gait_evaluate'
        )
    for path in options.sequence if options.out is not None else ():
        folder = options.out / os.path.basename(os.path.realpath(path))
        masks = [('--out', each, _is_mask) for each in sorted((folder / 'masks').glob('*.png'))]
        sheet = ('--out', folder / 'contact_sheet.png', is_own_picture)
        keep_others([*masks, sheet], 'gait_evaluate')
    if options.json not in (None, _OUTPUT):
        check_file(options.json)
    if options.out is not None:
        make_folder('--out', options.out)
    # Here, so that --help does not wait for the kernels to be loaded.
    from gait_segmentation.gait_model import TemplateBank
    from gait_segmentation.kernels import compile_kernels, compiling
    from gait_segmentation.pipeline import Pipeline, PipelineConfig

    to_output = options.json == _OUTPUT
    say = partial(print, file=sys.stderr if to_output else sys.stdout)
    cv2.setNumThreads(1)
    settings = list(options.set)
    if options.prior is not None:
        settings.append(f'segmentation.prior={options.prior}')
    config = PipelineConfig()
    if options.preset is not None:
        from gait_segmentation.cli.tool import Settings, read_parameter_file

        config = read_parameter_file(preset_file(options.preset), Settings(config)).config
    config = overridden(config, settings)
    bank = TemplateBank.load(options.bank) if options.bank is not None else None
    session = Session(
        sequences=load_sequences(options.sequence, options.heat_map),
        make_pipeline=partial(Pipeline, bank=bank, clock=time.perf_counter),
        clock=time.perf_counter,
        warm=options.warm,
        heat_map=options.heat_map,
        auto=options.init == 'auto',
        fixed=frozenset(setting.partition('=')[0].strip() for setting in settings),
    )
    with compiling(lambda text: print(f'gait_evaluate: {text}', file=sys.stderr)):
        compile_kernels()
    if options.ablate is not None:
        told = ('preset', 'bank', 'init', 'heat_map')
        about, written = [f'{name}={getattr(options, name)}' for name in told], ''
        given = options.boxes, options.jobs, options.spoil
        for line in ablate(session, config, [*about, *settings], options.out, *given):
            print(line, end='', flush=True)
            written += line
        if options.write is not None:
            write(options.write, with_part(options.write, options.ablate, written).encode())
        return
    report = session.evaluate(config, options.out)
    tables = table(report), tracking_table(report), place_table(report, session.sequences)
    say('\n\n'.join(filter(None, tables)))
    if to_output:
        print(json.dumps(report, indent=2))
    elif options.json is not None:
        write_json(options.json, report)


def _is_mask(head: bytes) -> bool:
    """Return whether a file begins as a PNG of 8 bits, grey, as masks are and frames are not."""
    return head.startswith(b'\x89PNG') and head[24:26] == b'\x08\0'


def _keep_inputs(options: argparse.Namespace) -> None:
    """Refuse outputs that would change what is read."""
    json_file = None if options.json == _OUTPUT else options.json
    outputs = [('--json', json_file), ('--write', options.write)]
    if options.out is not None:
        names = [os.path.basename(os.path.realpath(path)) for path in options.sequence]
        outputs += [
            ('--out', options.out / name / what)
            for name in names
            for what in ('masks', 'contact_sheet.png')
        ]
    settings = dict(setting.partition('=')[::2] for setting in options.set)
    others = (options.bank, settings.get('segmentation.vocabulary'))
    keep_apart(outputs, [*options.sequence, *(Path(each) for each in others if each)])


if __name__ == '__main__':
    sys.exit(main())

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
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cv2

from gait_segmentation.cli.tool import (
    PROCESSORS,
    add_config_options,
    check_ranges,
    command_parser,
    preset_file,
    run_tool,
)
from gait_segmentation.config import overridden, replaced
from gait_segmentation.errors import ConfigError
from gait_segmentation.files import keep_apart
from gait_segmentation.people import MOST_PEOPLE
from gait_tools.evaluation.ablation import SPOILT, ablate
from gait_tools.evaluation.mot_challenge import (
    BoxesById,
    MotSequence,
    found_boxes,
    load_mot_sequences,
    mot_report,
    read_tracks,
)
from gait_tools.evaluation.report import mot_table, place_table, table, tracking_table
from gait_tools.evaluation.session import Session, load_sequences, shown
from gait_tools.outputs import (
    check_file,
    is_own_picture,
    keep_others,
    make_folder,
    with_part,
    write,
    write_json,
)

if TYPE_CHECKING:  # which takes long to load
    from gait_segmentation.pipeline import Pipeline, PipelineConfig

_Scored = tuple[dict[str, Any], list[str]]  # the report, and its tables
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

or a folder of MOTChallenge (MOT17 and the like), of which boxes and identities
are scored, nobody gives a box, and which has 16 slots (unless --set ...):
  gt/gt.txt           frame,id,x,y,width,height,conf,class,visibility: who has
                      conf 0 or is of another class than 1 is ambiguous
  img1/NNNNNN.jpg     the images; frame 1 is the first
  seqinfo.ini         frameRate (or else 30), imDir

docs/evaluation.md says what the columns of the tables are.

examples
  gait_evaluate data/hall data/lucia --json scores.json
  gait_evaluate data/hall --json - | jq .mean.J
  gait_evaluate data/* --out out/eval --warm
  gait_evaluate data/* --preset paper --prior none
  gait_evaluate data/* --ablate mechanisms --out out/ablation --boxes 3 --jobs 2
  gait_evaluate data/hall --set segmentation.contrast=3 --bank mine.npz
  gait_evaluate data/hall --init auto --set people.max_people=1
  gait_evaluate MOT17/train/*-FRCNN --json scores.json
  gait_evaluate MOT17/train/MOT17-04-FRCNN --tracks tracks.txt
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
    add(
        '--tracks',
        type=Path,
        metavar='FILE',
        help='of folders of MOTChallenge: score these tracks, as gait_replay --tracks writes '
        'them, and run nothing; of several sequences a folder of NAME.txt',
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
    mot = _is_mot(options)
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
    to_output = options.json == _OUTPUT
    say = partial(print, file=sys.stderr if to_output else sys.stdout)
    cv2.setNumThreads(1)
    scored = _score_boxes(options) if mot else _score_masks(options)
    if scored is None:
        return
    report, tables = scored
    say('\n\n'.join(filter(None, tables)))
    if to_output:
        print(json.dumps(report, indent=2))
    elif options.json is not None:
        write_json(options.json, report)


def _score_masks(options: argparse.Namespace) -> _Scored | None:
    """Score sequences with masks; None of an ablation, which prints its table as it goes."""
    settings = _settings(options)
    config, make_pipeline = _prepared(options, settings)
    session = Session(
        sequences=load_sequences(options.sequence, options.heat_map),
        make_pipeline=make_pipeline,
        clock=time.perf_counter,
        warm=options.warm,
        heat_map=options.heat_map,
        auto=options.init == 'auto',
        fixed=frozenset(setting.partition('=')[0].strip() for setting in settings),
    )
    _compile()
    if options.ablate is not None:
        told = ('preset', 'bank', 'init', 'heat_map')
        about, written = [f'{name}={getattr(options, name)}' for name in told], ''
        given = options.boxes, options.jobs, options.spoil
        for line in ablate(session, config, [*about, *settings], options.out, *given):
            print(line, end='', flush=True)
            written += line
        if options.write is not None:
            write(options.write, with_part(options.write, options.ablate, written).encode())
        return None
    report = session.evaluate(config, options.out)
    tables = [table(report), tracking_table(report), place_table(report, session.sequences)]
    return report, tables


def _score_boxes(options: argparse.Namespace) -> _Scored:
    """Score folders of MOTChallenge: tracks that are given, or those of the pipeline."""
    sequences = load_mot_sequences(options.sequence)
    found = (
        _found(options, sequences)
        if options.tracks is None
        else (read_tracks(options.tracks, each.name) for each in sequences)
    )
    pairs = zip(sequences, found, strict=True)
    report = mot_report({each.name: each.compared(tracks) for each, tracks in pairs})
    return report, [mot_table(report)]


def _found(options: argparse.Namespace, sequences: list[MotSequence]) -> Iterator[BoxesById]:
    """Yield the tracks of the pipeline in each sequence, the same as by gait_replay."""
    from gait_segmentation.cli.lockstep import results_of

    config, make_pipeline = _prepared(options, _settings(options), slots=MOST_PEOPLE)
    # All, so that nothing is run if one cannot be used.
    sources = [each.source() for each in sequences]
    _compile()
    for each, source in zip(sequences, sources, strict=True):
        results = results_of(source, make_pipeline(config), None, _warn)
        yield found_boxes(shown(results, each.name, source.total or 0))


def _settings(options: argparse.Namespace) -> list[str]:
    """Return what is changed of the parameters."""
    prior = [] if options.prior is None else [f'segmentation.prior={options.prior}']
    return [*options.set, *prior]


def _prepared(
    options: argparse.Namespace, settings: list[str], slots: int = 0
) -> tuple[PipelineConfig, Callable[[Any], Pipeline]]:
    """Return the configuration, with a number of slots unless it is set, and what runs it."""
    # Here, so that --help does not wait for the kernels to be loaded.
    from gait_segmentation.gait_model import TemplateBank
    from gait_segmentation.pipeline import Pipeline, PipelineConfig

    config = PipelineConfig()
    if options.preset is not None:
        from gait_segmentation.cli.tool import Settings, read_parameter_file

        config = read_parameter_file(preset_file(options.preset), Settings(config)).config
    if slots:
        config = replaced(config, 'people', 'max_people', slots)
    config = overridden(config, settings)
    bank = TemplateBank.load(options.bank) if options.bank is not None else None
    return config, partial(Pipeline, bank=bank, clock=time.perf_counter)


def _compile() -> None:
    """Have the kernels compiled, and say so if that takes time."""
    from gait_segmentation.kernels import compile_kernels, compiling

    with compiling(_warn):
        compile_kernels()


def _warn(text: str) -> None:
    print(f'gait_evaluate: {text}', file=sys.stderr)


def _is_mot(options: argparse.Namespace) -> bool:
    """Return whether folders are of MOTChallenge; ConfigError if options do not go with them."""
    kinds = [MotSequence.is_at(path) for path in options.sequence]
    if not all(kinds):
        other = options.sequence[kinds.index(False)]
        if any(kinds) or options.tracks is not None:
            why = '--tracks needs' if options.tracks is not None else 'others here have'
            raise ConfigError(
                f'{other} has no gt/gt.txt, which {why}: score other sequences by themselves'
            )
        return False
    of_masks = ('warm', 'heat_map', 'ablate', 'out', 'write')
    of_pipelines = ('set', 'preset', 'prior', 'bank') if options.tracks is not None else ()
    for names, why in (
        (of_masks, 'is for sequences with masks, and a folder of MOTChallenge has none'),
        (of_pipelines, 'is for the pipeline, which --tracks does not run'),
    ):
        for name in names:
            if getattr(options, name):
                raise ConfigError(f'--{name.replace("_", "-")} {why}: leave it out')
    return True


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
    others = (options.bank, options.tracks, settings.get('segmentation.vocabulary'))
    keep_apart(outputs, [*options.sequence, *(Path(each) for each in others if each)])


if __name__ == '__main__':
    sys.exit(main())

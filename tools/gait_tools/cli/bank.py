# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The command ``gait_bank``: make, show and describe template banks."""

from __future__ import annotations

import argparse
import math
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from tqdm import tqdm

from gait_segmentation.cli.tool import run_tool
from gait_segmentation.config import StageConfig, parameters_of
from gait_segmentation.errors import BankError
from gait_segmentation.files import keep_apart
from gait_segmentation.gait_model import TemplateBank, default_bank
from gait_segmentation.paper.vocabulary import WORDS_FORMAT, VocabularyError
from gait_tools.gait_model import BUILDS, BankSpec, build_bank
from gait_tools.gait_model.builder import DIRECTIONS, draw_views
from gait_tools.gait_model.silhouettes import (
    SilhouetteSequence,
    bank_from_silhouettes,
    read_masks,
    read_silhouettes,
)
from gait_tools.outputs import is_own_picture, keep_others, write_figure
from gait_tools.vocabulary_training import (
    MODEL,
    Silhouette,
    VocabularySpec,
    bank_silhouettes,
    draw_vocabulary,
    learn_vocabulary,
    mask_silhouettes,
    write_vocabulary,
)

_BUILD_TEXT = """
Without --from, the bank is drawn from the package's gait model: every build is
seen from evenly spaced directions and drawn at every phase of the stride.
Builds: {builds}.

With --from, every folder becomes one sequence of templates: its images, in the
order of the numbers in their names, must be silhouettes (white on black) of
one walker who keeps one direction for at least one stride, all of the body in
view, as gait_replay --masks writes them.  They have one size, or each is cut
out by its box.  Images before the walker comes and after they are gone may be
empty.  The period is estimated; phase 0 is where the legs are farthest
apart.  Which leg is in front then cannot be seen in profile: --first-contact
tells it.  Several walkers are several builds, which are all matched, or with
--average one, the mean of all who walk in the same direction.

Azimuth is the direction of walking: 0 to the right in the image, 90 away from
the camera, 180 to the left, -90 towards the camera.

examples:
  gait_bank build bank.npz
  gait_bank build side.npz --azimuths 2 --builds average,coat
  gait_bank build mine.npz --from walk1 walk2 --azimuth 180 0 --mirror
  gait_bank build mean.npz --from anna ben cleo --azimuth 180 --mirror --average
"""

_VOCABULARY_TEXT = """\
The words are Gaussians over position and orientation of outline points, found
by K-means and then EM.  They split the outline of a template where
segmentation.prior is 'paper'; name the file in segmentation.vocabulary to use
it.  Learning needs scikit-learn: pip install scikit-learn

Without --from, the silhouettes are drawn from the package's gait model (576:
6 builds, 16 views, 6 phases).  With --from, they are the images in the folders,
laid out as for "gait_bank build --from" or in any other order and of any sizes:
grey values of 128 and more are the person, all of the body in view.  Images with
nobody, or somebody less than 16 pixels tall, are left out.  A few hundred of
varied people, views and phases are needed for words that fit everybody.

examples:
  gait_bank vocabulary words.json --picture words.png
  gait_bank vocabulary mine.json --from walk1 walk2 --words 12
"""
_MARGIN, _DPI = 80, 100  # room for the labels, and what an inch has, in pixels


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    made = argparse.ArgumentParser(
        prog='gait_bank',
        description='Make, show and describe banks of walking silhouettes (template banks).',
    )
    commands = made.add_subparsers(dest='command', required=True, metavar='COMMAND')
    build = commands.add_parser(
        'build',
        help='make a bank from the gait model or from silhouettes',
        description='Make a bank from the gait model or, with --from, from silhouettes.',
        epilog=_BUILD_TEXT.format(builds=', '.join(BUILDS)),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    build.add_argument('output', type=Path, help='the bank file to write (.npz)')
    add = build.add_argument_group('silhouettes').add_argument
    words = 'folders of silhouettes, one sequence each'
    add('--from', dest='folders', type=Path, nargs='+', metavar='FOLDER', help=words)
    words = 'direction of walking of every folder in degrees, or one for all; needs --from'
    add('--azimuth', nargs='+', type=float, metavar='DEG', help=words)
    words = 'leg of the first heel contact in the folders (default: right)'
    add('--first-contact', choices=('right', 'left'), help=words)
    add('--mirror', action='store_true', help='add the mirror image of every folder')
    words = 'average the walkers of each direction into one; without it, they are kept apart'
    add('--average', action='store_true', help=words)
    _add_spec_options(build, BankSpec, 'the bank')
    words = 'Write a picture of a bank: a row for every sequence, a column for a phase.'
    show = commands.add_parser('show', help='write a picture of a bank', description=words)
    words = 'the picture to write (default: bank.png)'
    show.add_argument('-o', '--output', type=Path, default='bank.png', help=words)
    words = 'phases to show (default: 10)'
    show.add_argument('--columns', type=int, default=10, metavar='N', help=words)
    words = 'Print size, builds, azimuths and origin of a bank.'
    info = commands.add_parser('info', help='describe a bank', description=words)
    for each in (show, info):
        words = 'a bank file; the standard bank if left out'
        each.add_argument('bank', type=Path, nargs='?', help=words)
    _add_vocabulary(commands)
    return made


def _add_vocabulary(commands: Any) -> None:
    """Add the subcommand ``vocabulary``."""
    made = commands.add_parser(
        'vocabulary',
        help="learn the words of the paper's shape prior",
        description="Learn the vocabulary of the paper's oriented shape prior from silhouettes.",
        epilog=_VOCABULARY_TEXT,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    made.add_argument('output', type=Path, help='the vocabulary file to write (.json)')
    add, words = made.add_argument, 'folders of silhouettes'
    add('--from', dest='folders', type=Path, nargs='+', metavar='FOLDER', help=words)
    add('--picture', type=Path, metavar='FILE', help='write a picture of the words, too')
    _add_spec_options(made, VocabularySpec, 'the words')


def _add_spec_options(
    parser: argparse.ArgumentParser, spec: type[StageConfig], title: str
) -> None:
    """Add an option for each parameter of a specification, to be read by :func:`_spec_of`."""
    group = parser.add_argument_group(title)
    for about in parameters_of(spec):
        unit = f' [{about.unit}]' if about.unit else ''
        default = f'{about.default:g}' if about.type is float else about.default
        group.add_argument(
            f'--{about.name.replace("_", "-")}',
            dest=about.name,
            type=about.type,
            default=argparse.SUPPRESS,
            metavar={int: 'N', float: 'X', str: 'NAMES'}[about.type],
            help=f'{about.description}{unit} Default: {default}.'.replace('%', '%%'),
        )


def _spec_of(options: argparse.Namespace, spec: type[StageConfig]) -> dict[str, Any]:
    """Return the parameters of a specification that were given."""
    names = [about.name for about in parameters_of(spec)]
    return {name: getattr(options, name) for name in names if hasattr(options, name)}


def _azimuths(options: argparse.Namespace) -> list[float]:
    """Return one azimuth in radians for every folder."""
    given, folders = options.azimuth, options.folders
    if given is None:
        raise BankError('--from needs --azimuth: one direction for all folders, or one for each')
    if len(given) not in (1, len(folders)):
        raise BankError(
            f'--azimuth must have 1 or {len(folders)} values for {len(folders)} folders, '
            f'got {len(given)}'
        )
    for value in given:
        if not abs(value) <= 360:
            raise BankError(f'--azimuth must be from -360 to 360 degrees, got {value:g}')
    return [math.radians(value) for value in (given * len(folders))[: len(folders)]]


def _names(folders: list[Path]) -> list[str]:
    """Return the builds' names: those of the folders, with their folders' if two are the same."""
    # Not by Path.resolve, which some versions of Python let fail at links in a circle.
    paths = [Path(os.path.realpath(folder)) for folder in folders]
    names = [path.name for path in paths]
    if len(set(names)) == len(names):
        return names
    return [f'{path.parent.name}_{path.name}' for path in paths]


def _build(options: argparse.Namespace) -> None:
    given = _spec_of(options, BankSpec)
    spec, output = BankSpec(**given), options.output
    if not output.parent.is_dir():
        raise BankError(f'cannot write the bank {output}: {output.parent} is not a folder')
    of_folders = options.azimuth is not None or options.first_contact is not None
    keep_apart([('the bank', output)], options.folders or ())
    keep_others([('the bank', output, _is_bank)], 'gait_bank')
    if options.folders is None and (of_folders or options.mirror or options.average):
        raise BankError('--azimuth, --first-contact, --mirror and --average belong to --from')
    # What of a specification does not matter to silhouettes that are given.
    drawn = [f'--{name}' for name in ('builds', 'azimuths', 'elevation') if name in given]
    if options.folders is not None and drawn:
        raise BankError(f'{", ".join(drawn)}: only a bank without --from has them')
    count = len(options.folders or ()) or len(spec.build_names) * (spec.azimuths + DIRECTIONS)
    with tqdm(total=count, unit='sequence', disable=None, leave=False) as bar:
        if options.folders is None:
            bank = build_bank(spec, bar.update)
        else:
            first = options.first_contact or 'right'
            azimuths, folders = _azimuths(options), options.folders
            sequences = [
                SilhouetteSequence(read_silhouettes(folder), azimuth, name, first)
                for folder, azimuth, name in zip(folders, azimuths, _names(folders), strict=True)
            ]
            how: dict[str, bool] = {'mirror': options.mirror, 'average': options.average}
            bank = bank_from_silhouettes(sequences, spec, progress=bar.update, **how)
    bank.save(output)
    height, width = bank.grid
    several = 's' * (bank.sequences != 1)
    print(
        f'{output}: {bank.sequences} sequence{several} x {bank.phases} phases of {height} x '
        f'{width} pixels'
    )


def _is_bank(head: bytes) -> bool:
    # The first entry of the archive, and what it says; banks of other versions are banks, too.
    return head.startswith(b'PK') and b'format.npy' in head[:64]


def _open(name: Path | None) -> TemplateBank:
    return default_bank() if name is None else TemplateBank.load(name)


def _show(options: argparse.Namespace) -> None:
    output = options.output
    keep_apart([('--output', output)], [options.bank] if options.bank else [])
    keep_others([('--output', output, is_own_picture)], 'gait_bank')
    sheet = contact_sheet(_open(options.bank), options.columns)
    write_figure(output, sheet)
    width, height = sheet.canvas.get_width_height()
    print(f'{output}: {width} x {height} pixels')


def contact_sheet(bank: TemplateBank, columns: int) -> Figure:
    """Draw the templates of so many phases, a row for each build and azimuth."""
    if columns < 1:
        raise BankError(f'columns must be at least 1, got {columns}')
    columns = min(columns, bank.phases)
    phases = [k * bank.phases // columns for k in range(columns)]
    height, width = bank.grid
    degrees = np.degrees(bank.azimuth)
    names = [f'{build}\n{way:.0f} deg' for build, way in zip(bank.builds, degrees, strict=True)]
    size = columns * width + _MARGIN, bank.sequences * height + _MARGIN
    figure = Figure(figsize=(size[0] / _DPI, size[1] / _DPI), dpi=_DPI, layout='constrained')
    axes = figure.subplots()
    axes.imshow(np.block([list(row) for row in bank.templates[:, phases]]), cmap='gray')
    axes.set_xticks(
        width * (np.arange(columns) + 0.5), [f'{each / bank.phases:.2f}' for each in phases]
    )
    axes.set_yticks(height * (np.arange(bank.sequences) + 0.5), names)
    axes.set_xlabel('phase')
    return figure


def _info(options: argparse.Namespace) -> None:
    bank = _open(options.bank)
    about: dict[str, Any] = {
        'sequences': bank.sequences,
        'phases': bank.phases,
        'height': bank.grid[0],
        'width': bank.grid[1],
        'fill': bank.fill,
        'grey_levels': len(np.unique(bank.templates)),
        'builds': ', '.join(dict.fromkeys(bank.builds)),
        'azimuths_deg': ', '.join(
            str(each) for each in sorted({round(math.degrees(float(a)), 2) for a in bank.azimuth})
        ),
    }
    about |= {f'provenance {key}': text for key, text in bank.provenance.items()}
    for name, value in about.items():
        print(f'{name:20} {value}')


def _learn(options: argparse.Namespace) -> None:
    """Learn and write a vocabulary."""
    spec = VocabularySpec(**_spec_of(options, VocabularySpec))
    output, picture = options.output, options.picture
    outputs = [('the vocabulary', output), ('--picture', picture)]
    keep_apart(outputs, options.folders or ())
    kinds = [
        (*outputs[0], lambda head: WORDS_FORMAT.encode() in head),
        (*outputs[1], is_own_picture),
    ]
    keep_others(kinds, 'gait_bank vocabulary')
    for path in (output, picture or output):
        if not path.parent.is_dir():
            raise VocabularyError(f'cannot write {path}: {path.parent} is not a folder')
    with tqdm(unit='sequence', disable=None, leave=False) as bar:
        silhouettes, source = _silhouettes(options.folders, bar)
        bar.set_description(f'learning from {len(silhouettes)} silhouettes')
        vocabulary = learn_vocabulary(silhouettes, spec, source)
    write_vocabulary(vocabulary, output)
    if picture is not None:
        chosen = np.linspace(0, len(silhouettes) - 1, 8).astype(int)[1:-1]
        words = draw_vocabulary(vocabulary, [silhouettes[k] for k in chosen])
        write_figure(picture, words)
    about = vocabulary.provenance
    print(
        f'{output}: {vocabulary.words} words from {about["silhouettes"]} silhouettes '
        f'({about["outline points"]} outline points)'
    )


def _silhouettes(folders: list[Path] | None, bar: tqdm[Any]) -> tuple[list[Silhouette], str]:
    """Return the silhouettes to learn from, and in words where they are from."""
    if folders is None:
        bar.reset(len(MODEL.build_names) * MODEL.azimuths)
        return list(bank_silhouettes(draw_views(MODEL, bar.update))), 'gait model'
    bar.reset(len(folders))
    found: list[Silhouette] = []
    for folder in folders:
        masks = [mask for _, mask in read_masks(folder)]
        try:
            found += mask_silhouettes(masks)
        except VocabularyError as error:
            raise VocabularyError(f'{folder}: {error}') from error
        bar.update()
    return found, 'folders ' + ', '.join(folder.name for folder in folders)


def _run(options: argparse.Namespace) -> None:
    runs = {'build': _build, 'show': _show, 'info': _info, 'vocabulary': _learn}
    runs[options.command](options)


def main(argv: list[str] | None = None) -> int:
    """Run the command and return its exit code."""
    return run_tool('gait_bank', lambda: _run(parser().parse_args(argv)))


if __name__ == '__main__':
    sys.exit(main())

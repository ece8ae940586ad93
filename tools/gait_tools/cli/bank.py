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

import cv2
import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from gait_segmentation.cli.tool import run_tool
from gait_segmentation.errors import BankError
from gait_segmentation.files.output_files import keep_apart
from gait_segmentation.gait_model import TemplateBank, default_bank
from gait_tools.cli import vocabulary
from gait_tools.cli.spec_options import add_spec_options, spec_of
from gait_tools.gait_model import BUILDS, BankSpec, build_bank
from gait_tools.gait_model.builder import DIRECTIONS
from gait_tools.gait_model.silhouettes import (
    SilhouetteSequence,
    bank_from_silhouettes,
    read_silhouettes,
)
from gait_tools.outputs import is_own_picture, keep_others, write_picture

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

_MARGIN = 96  # columns left of the templates for the labels
_HEADER = 16  # rows above them
_DRAWN = ('builds', 'azimuths', 'elevation')
"""What of a :class:`BankSpec` does not matter to silhouettes that are given."""


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
    build.add_argument('output', help='the bank file to write (.npz)')
    source = build.add_argument_group('silhouettes')
    source.add_argument(
        '--from',
        dest='folders',
        nargs='+',
        metavar='FOLDER',
        help='folders of silhouettes, one sequence each',
    )
    source.add_argument(
        '--azimuth',
        nargs='+',
        type=float,
        metavar='DEG',
        help='direction of walking of every folder in degrees, or one for all; needs --from',
    )
    source.add_argument(
        '--first-contact',
        choices=('right', 'left'),
        help='leg of the first heel contact in the folders (default: right)',
    )
    source.add_argument(
        '--mirror', action='store_true', help='add the mirror image of every folder'
    )
    source.add_argument(
        '--average',
        action='store_true',
        help='average the walkers of each direction into one; without it, they are kept apart',
    )
    add_spec_options(build, BankSpec, 'the bank')
    show = commands.add_parser(
        'show',
        help='write a picture of a bank',
        description='Write a picture of a bank: a row for every sequence, a column for a phase.',
    )
    show.add_argument('bank', nargs='?', help='a bank file; the standard bank if left out')
    show.add_argument(
        '-o', '--output', default='bank.png', help='the picture to write (default: bank.png)'
    )
    show.add_argument(
        '--columns', type=int, default=10, metavar='N', help='phases to show (default: 10)'
    )
    info = commands.add_parser(
        'info',
        help='describe a bank',
        description='Print size, builds, azimuths and origin of a bank.',
    )
    info.add_argument('bank', nargs='?', help='a bank file; the standard bank if left out')
    vocabulary.add_parser(commands)
    return made


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


def _names(folders: list[str]) -> list[str]:
    """Return the builds' names: those of the folders, with their folders' if two are the same."""
    # Not by Path.resolve, which some versions of Python let fail at links in a circle.
    paths = [Path(os.path.realpath(folder)) for folder in folders]
    names = [path.name for path in paths]
    if len(set(names)) == len(names):
        return names
    return [f'{path.parent.name}_{path.name}' for path in paths]


def _build(options: argparse.Namespace) -> None:
    given = spec_of(options, BankSpec)
    spec = BankSpec(**given)
    output = Path(options.output)
    if not output.parent.is_dir():
        raise BankError(f'cannot write the bank {output}: {output.parent} is not a folder')
    of_folders = options.azimuth is not None or options.first_contact is not None
    keep_apart([('the bank', output)], map(Path, options.folders or ()))
    keep_others([('the bank', output, _is_bank)], 'gait_bank')
    if options.folders is None and (of_folders or options.mirror or options.average):
        raise BankError('--azimuth, --first-contact, --mirror and --average belong to --from')
    drawn = [f'--{name}' for name in _DRAWN if name in given]
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
            bank = bank_from_silhouettes(
                sequences,
                spec,
                mirror=options.mirror,
                average=options.average,
                progress=bar.update,
            )
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


def _open(name: str | None) -> TemplateBank:
    return default_bank() if name is None else TemplateBank.load(name)


def _show(options: argparse.Namespace) -> None:
    output = Path(options.output)
    keep_apart([('--output', output)], [Path(options.bank)] if options.bank else [])
    keep_others([('--output', output, is_own_picture)], 'gait_bank')
    sheet = contact_sheet(_open(options.bank), options.columns)
    write_picture(output, sheet, BankError)
    print(f'{output}: {sheet.shape[1]} x {sheet.shape[0]} pixels')


def _text(image: NDArray[np.uint8], text: str, x: int, y: int) -> None:
    cv2.putText(image, text, (x, y), cv2.FONT_HERSHEY_SIMPLEX, 0.35, 200, 1, cv2.LINE_AA)


def contact_sheet(bank: TemplateBank, columns: int) -> NDArray[np.uint8]:
    """Return the templates of so many phases, labelled with build, azimuth and phase."""
    if columns < 1:
        raise BankError(f'columns must be at least 1, got {columns}')
    columns = min(columns, bank.phases)
    phases = [k * bank.phases // columns for k in range(columns)]
    height, width = bank.grid
    sheet = np.zeros(
        (_HEADER + bank.sequences * height, _MARGIN + columns * width), dtype=np.uint8
    )
    for column, phase in enumerate(phases):
        _text(sheet, f'{phase / bank.phases:.2f}', _MARGIN + column * width + width // 3, 11)
    for sequence in range(bank.sequences):
        top = _HEADER + sequence * height
        _text(sheet, f'{sequence}', 4, top + height // 2 - 16)
        _text(sheet, bank.builds[sequence][:14], 4, top + height // 2)
        degrees = math.degrees(float(bank.azimuth[sequence]))
        _text(sheet, f'{degrees:.0f} deg', 4, top + height // 2 + 16)
        tiles = bank.templates[sequence, phases]
        sheet[top : top + height, _MARGIN:] = np.hstack(list(tiles))
    return sheet


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


def _run(options: argparse.Namespace) -> None:
    runs = {'build': _build, 'show': _show, 'info': _info, 'vocabulary': vocabulary.run}
    runs[options.command](options)


def main(argv: list[str] | None = None) -> int:
    """Run the command and return its exit code."""
    return run_tool('gait_bank', lambda: _run(parser().parse_args(argv)))


if __name__ == '__main__':
    sys.exit(main())

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``gait_demo``: a film as a live camera, the three nodes over DDS, pictures and a report."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.cli.clip import CLIP_BOX, CLIP_START, demo_clip
from gait_segmentation.cli.replaying.file_outputs import MasksOutput, OverlayOutput
from gait_segmentation.cli.replaying.output import About, Output, Replayed
from gait_segmentation.cli.tool import (
    READING,
    add_preset_option,
    add_reading_options,
    command_parser,
    make_folder,
    run_tool,
    scaled_box,
)
from gait_segmentation.drawing import track_colour
from gait_segmentation.errors import ConfigError, SequenceError
from gait_segmentation.files.output_files import (
    is_own_picture,
    keep_apart,
    keep_others,
    write_file,
    write_picture,
)
from gait_segmentation.geometry import Box
from gait_segmentation.inputs import ImageSource, open_input
from gait_segmentation.people import MOST_PEOPLE
from gait_segmentation.pipeline import PersonResult
from gait_segmentation.sheets import contact_sheet, spread, tile

if TYPE_CHECKING:
    from gait_segmentation.cli.live import Recording

__all__ = ['main', 'parser']

_WRITTEN = ('masks', 'overlay.mp4', 'contact_sheet.png', 'report.json', 'logs')

DESCRIPTION = """\
Show the package at work on this computer.

A film is played as a live camera at its own rate, 960 pixels wide unless --width
says otherwise; gait_tracker, gait_matcher and gait_segmenter run as separate
processes, as on a robot, and what they publish is recorded. The film shows a
woman walking past a static camera (from the package Sports2D, BSD-3-Clause,
downloaded once); --clip plays another.
"""

EPILOG = """\
writes to the output folder
  masks/NNNN.png     the silhouettes, named by the frame's number in the film
  overlay.mp4        the film with outline, box, direction and phase
  contact_sheet.png  28 frames of the person seen longest, with outline and phase
  report.json        frames played, answered and with a silhouette, and latency
                     from the frame's stamp to its mask
  logs/NAME.log      what the processes logged

examples (after colcon build with "ros2 run gait_segmentation" in front)
  gait_demo
  gait_demo --preset paper --out out/paper
  gait_demo --clip walk.mp4 --people 3 --out out/walk
  gait_demo --clip walk.mp4 --box 400 120 80 260 --start 15 --out out/walk
"""


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    made = command_parser('gait_demo', DESCRIPTION, EPILOG)
    add = made.add_argument
    add('--out', type=Path, default=Path('out/demo'), help='output folder (%(default)s)')
    add('--clip', type=Path, metavar='FILE', help='a film, folder of images or bag of your own')
    add(
        '--box',
        type=float,
        nargs=4,
        metavar=('X', 'Y', 'W', 'H'),
        help='with --clip: tight box of a person in the first frame played, in pixels of the '
        'film; without, people are found by their walk',
    )
    add('--people', type=int, default=1, metavar='N', help='people at a time (%(default)s)')
    add_preset_option(made)
    add_reading_options(made, "the film's")
    made.set_defaults(width=960)
    return made


def main(arguments: list[str] | None = None) -> int:
    """Run the command and return its exit code."""
    return run_tool('gait_demo', lambda: _demonstrate(parser().parse_args(arguments)))


def _demonstrate(options: argparse.Namespace) -> None:
    """Play the film through the nodes, and write and say what became of it."""
    reading = {name: getattr(options, name) for name in READING}
    film, box = _film_and_box(options, reading)
    out = options.out
    keep_apart([('--out', out / name) for name in _WRITTEN], [film.path])
    make_folder('--out', out)
    for kind, path in ((MasksOutput, out / 'masks'), (OverlayOutput, out / 'overlay.mp4')):
        kind.check(path)
        if kind.is_there(path) and not (out / 'report.json').is_file():
            raise ConfigError(f'{path} was not made by gait_demo: choose another --out')
    keep_others([('--out', out / 'report.json', _is_report)], 'gait_demo')
    if not (out / 'report.json').is_file():
        keep_others([('--out', out / 'contact_sheet.png', is_own_picture)], 'gait_demo')
    # Here, so that --help needs no ROS.
    from gait_segmentation.cli.live import play

    recording = play(
        film,
        out / 'logs',
        box=box,
        people=options.people,
        preset=options.preset or 'default',
        **reading,
    )
    played, answered = len(recording.published), recording.answered()
    if len(answered) < played:
        print(f'gait_demo: {lost_frames(played - len(answered), recording)}', file=sys.stderr)
    if not answered:
        raise SequenceError(f'no frame was answered: see what the nodes say in {out / "logs"}')
    seen = write_pictures(out, recording, film, options.rate or film.fps)
    stamps = [recording.published[number] for number in answered]
    latency_ms = [1e3 * recording.arrived_s[stamp] - stamp / 1e6 for stamp in stamps]
    median, high = (round(float(each), 1) for each in np.percentile(latency_ms, (50, 95)))
    report = {
        'frames_played': played,
        'frames_answered': len(answered),
        'frames_with_silhouette': seen,
        'latency_ms': {'p50': median, 'p95': high},
    }
    write_file(out / 'report.json', (json.dumps(report, indent=2) + '\n').encode())
    print(
        f'{len(answered)} of {played} frames answered, {seen} with a silhouette; latency '
        f'{median:.0f} ms, 95 % within {high:.0f} ms; see {out}'
    )


def _is_report(head: bytes) -> bool:
    return b'"frames_played": ' in head


def _film_and_box(
    options: argparse.Namespace, reading: dict[str, Any]
) -> tuple[ImageSource, Box | None]:
    """
    Return the film and the person's box in the pixels that are played, None to find people.

    :param reading: arguments of :func:`open_input`; the first frame of the clip is put in.
    """
    box = None if options.box is None else Box(*options.box)
    if not 1 <= options.people <= MOST_PEOPLE:
        raise ConfigError(f'--people must be from 1 to {MOST_PEOPLE}, got {options.people}')
    if options.clip is None:
        if box is not None or options.start:
            raise ConfigError('--box and --start belong to a film of your own: give --clip too')
        options.clip, reading['start'], box = demo_clip(), CLIP_START, CLIP_BOX
    film = open_input(options.clip, **reading)
    return film, scaled_box(box, film)


def lost_frames(lost: int, recording: Recording) -> str:
    """Say why frames have no mask, and what can be done."""
    who = [f'{name} dropped {count}' for name, count in recording.dropped().items()]
    why = f'{" and ".join(who)}, which could not keep up: close other programs, or give a lower '
    why += '--rate or --width'
    if not who:
        why = 'no node says that it dropped them, so they were lost on the way between the nodes'
    return f'{lost} frame{"s" * (lost != 1)} lost: {why}'


def write_pictures(out: Path, recording: Recording, film: ImageSource, fps: float) -> int:
    """
    Write masks, overlay and contact sheet of the frames that were answered.

    The images are read again, in their order: all at once would take much memory.

    :returns: how many frames have a silhouette.
    :raises SequenceError: if a file cannot be written, or the film not be read again.
    """
    answered = recording.answered()
    seen: dict[int, list[int]] = {}
    for number in answered:
        for slot, person in enumerate(recording.result(number).people):
            if person.track.box is not None:
                seen.setdefault(slot, []).append(number)
    slot = max(seen, key=lambda each: len(seen[each]), default=0)
    shown = spread(seen.get(slot, answered))
    tiles, silhouettes, complete = [], 0, False
    outputs: list[Output] = [MasksOutput(out / 'masks')]
    try:
        outputs.append(OverlayOutput(out / 'overlay.mp4', About(film.size, fps)))
        for frame in film.frames():
            if frame.number not in answered:
                continue
            if frame.image is None:
                raise SequenceError(f'frame {frame.number} cannot be read again: {frame.problem}')
            result = recording.result(frame.number)
            silhouettes += bool(result.mask.any())
            if frame.number in shown:
                tiles.append(_tile(frame.image, frame.number, result.people[slot]))
            for output in outputs:
                with output.written():
                    output.add(Replayed(frame, result))
        complete = True
    finally:
        for output in outputs:
            output.close(complete=complete)
    write_picture(out / 'contact_sheet.png', contact_sheet(tiles))
    return silhouettes


def _tile(image: NDArray[np.uint8], number: int, person: PersonResult) -> NDArray[np.uint8]:
    """Return a crop of a frame about somebody, with outline, number and phase."""
    box = person.track.box or Box(0, 0, image.shape[1], image.shape[0])
    phase = '' if person.match.body is None else f' {person.match.phase:.2f}'
    outlines = [(person.segmentation.mask, track_colour(person.track.track_id))]
    return tile(image, box, outlines, f'{number}{phase}')


if __name__ == '__main__':
    sys.exit(main())

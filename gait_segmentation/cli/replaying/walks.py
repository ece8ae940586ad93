# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The walk of each tracked person, in a few numbers and as gait recognition reads it.

The data sets of OpenGait and similar systems hold one array (N, 64, 64) uint8 a walk, pickled, at
``subject/type/view/view.pkl``: every silhouette 64 pixels high and centred on its body, 0 to 255
with outlines that are grey from the scaling.
"""

from __future__ import annotations

import csv
import io
import math
import pickle
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.cli.replaying.outputs import STEPS_PER_STRIDE, Output
from gait_segmentation.errors import SequenceError
from gait_segmentation.files.output_files import write_file
from gait_segmentation.inputs import Frame
from gait_segmentation.pipeline import FrameResult, PersonResult

SUMMARY_COLUMNS = (
    'input',
    'person',
    'walk',
    'frames',
    'direction_rad',
    'cadence_steps_per_min',
    'confidence',
    'silhouettes',
)
"""A row is a walk."""

_LEAST_FRAMES = 5
"""Shorter walks are of no use: OpenGait warns of them."""

_LEAST_SUM = 10_000
"""Sum of the pixels (0/255) that OpenGait asks for in a silhouette."""

_SIDE = 64
"""Height and width of a silhouette in pixels."""

_VIEW_STEP = 45


@dataclass(frozen=True)
class Walk:
    """
    A track, over the frames that have a silhouette.

    ``walk`` is ``direction_rad``, the mean walking direction in the image, in degrees in steps of
    45: 000 = to the right, 090 = away from the camera, 180 = to the left, 270 = towards the
    camera.  The cadence is the median, None where it is not known, ``confidence`` the mean of the
    match's.
    """

    person: int
    walk: str
    frames: int
    direction_rad: float
    cadence_steps_per_min: float | None
    confidence: float


def _has_silhouette(person: PersonResult) -> bool:
    """Return whether a person is there, and large enough to be recognised."""
    return person.track.track_id > 0 and int(person.segmentation.mask.sum()) > _LEAST_SUM


class Walks:
    """Collects the walks of all tracks."""

    def __init__(self) -> None:
        """Begin without walks."""
        self._seen: dict[int, list[tuple[float, ...]]] = {}

    def add(self, result: FrameResult) -> None:
        """Add a frame."""
        for person in result.people:
            if _has_silhouette(person):
                match = person.match
                rate = match.phase_rate if match.body is not None else math.nan
                about = (match.azimuth, match.confidence, rate)
                self._seen.setdefault(person.track.track_id, []).append(about)

    def all(self) -> list[Walk]:
        """Return the walks that are long enough, by track id."""
        return [
            _walk(track_id, np.array(seen))
            for track_id, seen in sorted(self._seen.items())
            if len(seen) >= _LEAST_FRAMES
        ]


def _walk(track_id: int, seen: np.ndarray) -> Walk:
    azimuth, confidence, rates = seen.T
    rates = rates[np.isfinite(rates)]
    direction = math.atan2(float(np.sin(azimuth).mean()), float(np.cos(azimuth).mean()))
    return Walk(
        track_id,
        f'{round(math.degrees(direction) / _VIEW_STEP) * _VIEW_STEP % 360:03d}',
        len(seen),
        round(direction, 4),
        round(60 * STEPS_PER_STRIDE * float(np.median(rates)), 1) if len(rates) else None,
        round(float(confidence.mean()), 3),
    )


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
    A folder with the walk of each tracked person.

    The folder is the subject; the types are ``person-ID`` by track id, and the views are those of
    :class:`Walk`.
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
        self._walks = Walks()
        self._silhouettes: dict[int, list[NDArray[np.uint8]]] = {}

    @classmethod
    def is_there(cls, path: Path) -> bool:
        """Return whether the folder is there; it is empty where no person walks."""
        return path.is_dir()

    def add(self, frame: Frame, result: FrameResult) -> None:
        """Keep the silhouettes of all people."""
        self._walks.add(result)
        for person in filter(_has_silhouette, result.people):
            kept = self._silhouettes.setdefault(person.track.track_id, [])
            kept.append(normalised(person.segmentation.mask))

    def finish(self) -> None:
        """Write the walks."""
        for walk in self._walks.all():
            file = self.work / self.place_of(walk)
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes(pickle.dumps(np.stack(self._silhouettes[walk.person]), protocol=4))

    @staticmethod
    def place_of(walk: Walk) -> str:
        """Return where a walk is in the folder of an input."""
        return f'person-{walk.person:03d}/{walk.walk}/{walk.walk}.pkl'


def check_summary(path: Path) -> None:
    """
    Refuse a place where there is something else than a table of walks.

    :raises SequenceError: if anything is there that this has not made.
    """
    head = ','.join(SUMMARY_COLUMNS).encode() + b'\n'
    if path.is_dir() or (path.is_file() and path.read_bytes()[: len(head)] not in (b'', head)):
        raise SequenceError(
            f'{path} was not made by gait_replay and is not replaced: remove it or choose another '
            'place'
        )


def write_summary(path: Path, rows: Sequence[Mapping[str, object]]) -> None:
    """
    Write one table of walks, as CSV.

    :param rows: with the keys of :data:`SUMMARY_COLUMNS`.
    :raises OSError: if it cannot be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    text = io.StringIO(newline='')
    table = csv.DictWriter(text, SUMMARY_COLUMNS, lineterminator='\n')
    table.writeheader()
    table.writerows(rows)
    write_file(path, text.getvalue().encode())

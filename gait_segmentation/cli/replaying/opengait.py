# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Silhouettes as OpenGait and similar gait recognition systems read them.

Their data sets hold one array (N, 64, 64) uint8 a walk, pickled, at
``subject/type/view/view.pkl``: every silhouette 64 pixels high and centred on its body, 0 to 255
with outlines that are grey from the scaling.
"""

from __future__ import annotations

import math
import pickle
import re
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.cli.replaying.output import Output, Replayed

__all__ = ['SIDE', 'OpenGaitOutput', 'OpenGaitPeopleOutput', 'normalised']

SIDE = 64
"""Height and width of a silhouette in pixels."""

LEAST_FRAMES = 5
"""Shorter walks are of no use: OpenGait warns of them."""

_LEAST_SUM = 10_000
"""Sum of the pixels (0/255) that OpenGait asks for in a silhouette."""

_VIEW_STEP = 45


def normalised(mask: NDArray[np.uint8]) -> NDArray[np.uint8] | None:
    """
    Cut a silhouette out, 64 pixels high and centred.

    The centre is the median of its mass over the columns; what lies further than 32 pixels from
    it is cut off.

    :param mask: (H, W) uint8 0/255.
    :returns: (64, 64) uint8, 0 to 255, or None if there is too little to see.
    """
    if int(mask.sum()) <= _LEAST_SUM:
        return None
    rows = np.flatnonzero(mask.any(axis=1))
    cut = mask[rows[0] : rows[-1] + 1]
    width = max(int(cut.shape[1] * SIDE / cut.shape[0]), 1)
    sized = np.asarray(cv2.resize(cut, (width, SIDE), interpolation=cv2.INTER_CUBIC))
    mass = sized.sum(axis=0, dtype=np.int64).cumsum()
    center = int(np.searchsorted(mass, mass[-1] / 2))
    padded = np.pad(sized, ((0, 0), (SIDE // 2, SIDE // 2)))
    return padded[:, center : center + SIDE]


class OpenGaitOutput(Output):
    """
    A folder with the walk of everybody who was tracked.

    The folder is the subject; the types are ``person-ID`` by track id, and the view is the mean
    direction of the walk in degrees, in steps of 45: 000 = to the right in the image, 090 = away
    from the camera, 180 = to the left, 270 = towards the camera.
    """

    option = '--opengait'
    files = re.compile(r'person-\d+/\d{3}/\d{3}\.pkl')

    def begin(self) -> None:
        """Begin without walks."""
        self.work.mkdir(parents=True)
        self._walks: dict[int, list[NDArray[np.uint8]]] = {}
        self._directions: dict[int, list[float]] = {}

    @classmethod
    def is_own(cls, path: Path) -> bool:
        """Return that it is: nothing else has files of such names, which are checked before."""
        return True

    def add(self, replayed: Replayed) -> None:
        """Keep everybody's silhouette."""
        for person in replayed.result.people:
            track_id = person.track.track_id
            silhouette = normalised(person.segmentation.mask) if track_id else None
            if silhouette is not None:
                self._walks.setdefault(track_id, []).append(silhouette)
                self._directions.setdefault(track_id, []).append(person.match.azimuth)

    def finish(self) -> None:
        """Write the walks."""
        for track_id, walk in sorted(self._walks.items()):
            if len(walk) < LEAST_FRAMES:
                continue
            view = _view(self._directions[track_id])
            folder = self.work / self.walk_name(track_id) / view
            folder.mkdir(parents=True)
            data = pickle.dumps(np.stack(walk), protocol=4)
            (folder / f'{view}.pkl').write_bytes(data)

    def walk_name(self, track_id: int) -> str:
        """Return the folder of somebody's walk, to which that of the view is added."""
        return f'person-{track_id:03d}'


class OpenGaitPeopleOutput(OpenGaitOutput):
    """
    The same with everybody a subject of their own, ``NAME-person-ID``, and one type, ``walk``.

    So the folder of each film is a data set.  Who is who across films is not known.
    """

    files = re.compile(r'.+-person-\d+/walk/\d{3}/\d{3}\.pkl')

    def walk_name(self, track_id: int) -> str:
        """Return subject and type."""
        return f'{self.path.name}-{super().walk_name(track_id)}/walk'


def _view(azimuths: list[float]) -> str:
    mean = math.atan2(float(np.sin(azimuths).mean()), float(np.cos(azimuths).mean()))
    return f'{round(math.degrees(mean) / _VIEW_STEP) * _VIEW_STEP % 360:03d}'

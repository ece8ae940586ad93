# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Silhouettes as OpenGait and similar gait recognition systems read them.

Their data sets hold one array (N, 64, 64) uint8 a walk, pickled, at
``subject/type/view/view.pkl``: every silhouette 64 pixels high and centred on its body, 0 to 255
with outlines that are grey from the scaling.
"""

from __future__ import annotations

import pickle
import re
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.cli.replaying.output import Output, Replayed
from gait_segmentation.cli.replaying.walks import Walk, Walks, has_silhouette

__all__ = ['SIDE', 'OpenGaitOutput', 'OpenGaitPeopleOutput', 'normalised']

SIDE = 64
"""Height and width of a silhouette in pixels."""


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
    width = max(int(cut.shape[1] * SIDE / cut.shape[0]), 1)
    sized = np.asarray(cv2.resize(cut, (width, SIDE), interpolation=cv2.INTER_CUBIC))
    mass = sized.sum(axis=0, dtype=np.int64).cumsum()
    center = int(np.searchsorted(mass, mass[-1] / 2))
    padded = np.pad(sized, ((0, 0), (SIDE // 2, SIDE // 2)))
    return padded[:, center : center + SIDE]


class OpenGaitOutput(Output):
    """
    A folder with the walk of everybody who was tracked.

    The folder is the subject; the types are ``person-ID`` by track id, and the views are those of
    :class:`Walk`.
    """

    option = '--opengait'
    files = re.compile(r'person-\d+/\d{3}/\d{3}\.pkl')

    def begin(self) -> None:
        """Begin without walks."""
        self.work.mkdir(parents=True)
        self._walks = Walks()
        self._silhouettes: dict[int, list[NDArray[np.uint8]]] = {}

    @classmethod
    def is_there(cls, path: Path) -> bool:
        """Return whether the folder is there; it is empty where nobody walks."""
        return path.is_dir()

    @classmethod
    def is_own(cls, path: Path) -> bool:
        """Return that it is: nothing else has files of such names, which are checked before."""
        return True

    def add(self, replayed: Replayed) -> None:
        """Keep everybody's silhouette."""
        self._walks.add(replayed)
        for person in filter(has_silhouette, replayed.result.people):
            kept = self._silhouettes.setdefault(person.track.track_id, [])
            kept.append(normalised(person.segmentation.mask))

    def finish(self) -> None:
        """Write the walks."""
        for walk in self._walks.all():
            file = self.work / self.place_of(self.path.name, walk)
            file.parent.mkdir(parents=True)
            file.write_bytes(pickle.dumps(np.stack(self._silhouettes[walk.person]), protocol=4))

    @classmethod
    def place_of(cls, name: str, walk: Walk) -> str:
        """Return where a walk is in the folder of an input, which has a name."""
        return f'person-{walk.person:03d}/{walk.walk}/{walk.walk}.pkl'


class OpenGaitPeopleOutput(OpenGaitOutput):
    """
    The same with everybody a subject of their own, ``NAME-person-ID``, and one type, ``walk``.

    So the folder of each film is a data set.  Who is who across films is not known.
    """

    files = re.compile(r'.+-person-\d+/walk/\d{3}/\d{3}\.pkl')

    @classmethod
    def place_of(cls, name: str, walk: Walk) -> str:
        """Return subject, type, view and file."""
        return f'{name}-person-{walk.person:03d}/walk/{walk.walk}/{walk.walk}.pkl'

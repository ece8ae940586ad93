# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Cues: what tells a person from the surroundings besides colours and background.

A cue is a class in a file of its own, with its memory of one person: :meth:`Cue.evidence` says
what it makes of the pixels of a frame, and :meth:`Cue.learn` takes in the mask of a frame once it
has come back.  A new
one is named where a :class:`~gait_segmentation.tracking.target.Target` makes its person, and its
parameters in the configuration.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import Window
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.records import Record
from gait_segmentation.tracking.world import World


@dataclass(frozen=True)
class View:
    """
    The newest frame of a world about the place where somebody is expected.

    ``center`` (x, y) and ``height`` are those of the body in working pixels, ``window`` the rows
    and columns that are judged, ``logit`` (h, w) float32 what has been made of them so far, and
    ``seen`` whether the person was seen until now: of who is lost no motion is known.
    """

    world: World
    track_id: int
    center: tuple[float, float]
    height: float
    window: Window
    logit: NDArray[np.float32]
    seen: bool
    config: TrackingConfig


class Cue(ABC):
    """Evidence for the pixels of one person, learnt from the masks that come back."""

    @abstractmethod
    def evidence(self, view: View) -> NDArray[np.float32] | None:
        """Return log-likelihood ratios, (h, w) float32 of the window, None if nothing is known."""

    @abstractmethod
    def learn_values(self, values: NDArray[np.uint8], person: NDArray[np.uint8]) -> None:
        """
        Learn which of the values that were noted are the person's.

        :param values: (h, w) uint8, see :meth:`note`.
        :param person: (h, w) uint8, non-zero on the person.
        """

    def note(self, view: View, values: NDArray[np.uint8]) -> None:
        """Keep the values of the window's pixels with the frame until its mask comes."""
        view.world.now.notes[view.track_id, type(self).__name__] = view.window, values

    def learn(self, record: Record, track_id: int, mask: NDArray[np.uint8]) -> None:
        """
        Take in the mask of a frame, if anything was noted in that.

        :param mask: (H, W) uint8 0/255 of the working image.
        """
        noted = record.notes.get((track_id, type(self).__name__))
        if noted is not None:
            window, values = noted
            self.learn_values(values, mask[window])

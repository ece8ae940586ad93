# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Cues: what tells a person from the surroundings besides colours and background.

A cue is a class in a file of its own, with its memory of one person: :meth:`Cue.evidence` says
what it makes of the pixels of a frame, and :meth:`Cue.calibrate` takes in what it noted then once
the mask of the frame has come back.  A new one is named in :class:`.FusionTrack`, and its
parameters in the configuration.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.detector.detection import SoftMask
from gait_segmentation.images import Window
from gait_segmentation.scene.scene import View
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.pose import Pose
from gait_segmentation.tracking.state import State


@dataclass(frozen=True)
class CueInput:
    """
    The newest frame of a view about the place where a person is expected.

    ``states`` are those of the track, the newest last, ``pose`` that of the body, ``window`` the
    rows and columns that are judged, ``expected`` (h, w) uint8 the template or else the mask
    expected there, above 127 on the person, ``logit`` (h, w) float32 what has been made of the
    pixels so far, ``seen`` whether the person was seen until now: of who is lost no motion is
    known, ``usual_area`` that of the person in squared body heights, and ``drawn`` a mask of them
    by a network, of this frame or one shortly before, and the state in its frame.
    """

    view: View
    states: Sequence[State]
    pose: Pose
    window: Window
    expected: NDArray[np.uint8]
    logit: NDArray[np.float32]
    seen: bool
    usual_area: float
    config: TrackingConfig
    drawn: tuple[SoftMask, State] | None = None

    def moved(self, since: State) -> tuple[float, float]:
        """Return how far the body went since an earlier state, (x, y) in pixels."""
        (x, y), (to_x, to_y) = since.displacement, self.states[-1].displacement
        return to_x - x, to_y - y


class Evidence(NamedTuple):
    """
    What a cue makes of pixels.

    ``logit`` are log-likelihood ratios, (h, w) float32; ``values``, (h, w) uint8, are what the cue
    is to learn from when the mask of the frame comes.
    """

    logit: NDArray[np.float32]
    values: NDArray[np.uint8] | None = None


class Cue(ABC):
    """Evidence for the pixels of one person, learnt from the masks that come back."""

    @abstractmethod
    def evidence(self, given: CueInput) -> Evidence | None:
        """Return what the cue makes of the window's pixels, None if nothing is known."""

    def calibrate(  # noqa: B027
        self, values: NDArray[np.uint8], person: NDArray[np.uint8]
    ) -> None:
        """
        Learn which of the values that were noted are the person's.

        :param values: (h, w) uint8, see :class:`Evidence`.
        :param person: (h, w) uint8, non-zero on the person.
        """

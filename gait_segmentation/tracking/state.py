# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a track keeps of each frame."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import Window, shifted_part
from gait_segmentation.scene.scene import Frame, Shift


class Place(NamedTuple):
    """How far a body went until the frame of a stamp since its track began, in pixels."""

    stamp_ns: int
    displacement: Shift


@dataclass
class State:
    """
    A track in one frame.

    ``displacement`` is how far the body went since the track began, in pixels; ``notes`` has by
    cue a window and (h, w) uint8, what it will learn from when the mask of the frame comes.
    """

    frame: Frame
    displacement: Shift
    notes: dict[str, tuple[Window, NDArray[np.uint8]]] = field(default_factory=dict)

    @property
    def place(self) -> Place:
        """Return where the body was then."""
        return Place(self.frame.image.stamp_ns, self.displacement)


class Silhouette(NamedTuple):
    """A mask or template, (h, w) uint8 of the view, and where the body was in its frame."""

    image: NDArray[np.uint8]
    displacement: Shift

    def at(self, displacement: Shift, window: Window) -> NDArray[np.uint8]:
        """Return a window of it, moved along with the body; it may be a part of the image."""
        (x, y), (to_x, to_y) = self.displacement, displacement
        return shifted_part(self.image, round(to_x - x), round(to_y - y), window)

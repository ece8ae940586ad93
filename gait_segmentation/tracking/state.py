# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a track keeps of each frame."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import Window, placed, shifted_part
from gait_segmentation.scene.scene import MOST_KEPT, Frame, Shift

_MOST_PLACES = 64
"""Frames of which it is known where somebody was, when a look at one of them comes."""


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

    def noted(self, name: str) -> NDArray[np.uint8] | None:
        """Return a note in an image of the frame's size, (H, W) uint8, None if there is none."""
        if (note := self.notes.get(name)) is None:
            return None
        return placed(note[1], note[0], self.frame.image.gray.shape)


class History:
    """
    How a track went: its ``states`` in the frames that are kept, the newest last, and its places.

    Of places more are known than of states: a look may come later than a mask.
    """

    def __init__(self, frame: Frame) -> None:
        """Begin in a frame."""
        self.states = deque([State(frame, (0.0, 0.0))], maxlen=MOST_KEPT)
        self._places = deque[Place](maxlen=_MOST_PLACES)

    def enter(self, frame: Frame) -> None:
        """Go on into the next frame, in the same place."""
        self._places.append(self.states[-1].place)
        self.states.append(State(frame, self.displacement))

    def shift(self, dx: float, dy: float) -> None:
        """Move the body in the newest frame."""
        x, y = self.displacement
        self.states[-1].displacement = (x + dx, y + dy)

    def note(self, name: str, window: Window, values: NDArray[np.uint8]) -> None:
        """Keep what will be learnt from when the mask of the newest frame comes."""
        self.states[-1].notes[name] = window, values

    @property
    def displacement(self) -> Shift:
        """Return how far the body went since the track began, in pixels."""
        return self.states[-1].displacement

    @property
    def known_since_ns(self) -> int:
        """Return the stamp from which on it is known where they were, 0 = all the time."""
        return self._places[0].stamp_ns if len(self._places) == _MOST_PLACES else 0

    def place_at(self, stamp_ns: int) -> Place:
        """Return where the body was in the known frame nearest to a stamp."""
        nearest = self.states[-1].place
        for place in reversed(self._places):
            if abs(place.stamp_ns - stamp_ns) > abs(nearest.stamp_ns - stamp_ns):
                break
            nearest = place
        return nearest

    def state_in(self, frame: Frame) -> State | None:
        """Return the state in a frame, None if there is none."""
        return next((each for each in self.states if each.frame is frame), None)


class Silhouette(NamedTuple):
    """A mask or template, (h, w) uint8 of the view, and where the body was in its frame."""

    image: NDArray[np.uint8]
    displacement: Shift

    def at(self, displacement: Shift, window: Window) -> NDArray[np.uint8]:
        """Return a window of it, moved along with the body; it may be a part of the image."""
        (x, y), (to_x, to_y) = self.displacement, displacement
        return shifted_part(self.image, round(to_x - x), round(to_y - y), window)

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What happens before the tracking: changes of size, and whom tracks start from."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import InputError
from gait_segmentation.geometry import Box, check_start_box


class Intake:
    """
    Watches sizes, and starts tracks.

    Boxes asked for by :meth:`request` start tracks at the next frame: the newest, as many as there
    are slots, since each costs time and more could not be kept.  The initial box does so at the
    first frame that is not earlier than its stamp, and again after :meth:`arm`.
    """

    def __init__(
        self,
        *,
        reset: Callable[[], None],
        initialize: Callable[[Box], None],
        warn: Callable[[str, str], object],
        slots: int = 1,
        initial_box: Box | None = None,
        initial_stamp_ns: int = 0,
    ) -> None:
        """Wait for a frame; ``reset`` drops all tracks, ``warn`` takes a key and a text."""
        self._reset = reset
        self._initialize = initialize
        self._warn = warn
        self._initial_box = initial_box
        self._initial_stamp_ns = initial_stamp_ns
        self._armed = True
        self.requested: deque[Box] = deque(maxlen=slots)
        """The boxes that tracks are to start from at the next frame."""

        self.shape: tuple[int, int] | None = None

    def request(self, box: Box) -> None:
        """Start a track at the next frame; of more than there are slots the oldest is dropped."""
        self.requested.append(box)

    def arm(self) -> None:
        """Start from the initial box again, as in a bag that loops."""
        self._armed = True

    def take(self, image: NDArray[np.uint8], stamp_ns: int) -> None:
        """Prepare the stages for a frame, (height, width, 3) uint8."""
        height, width = shape = (image.shape[0], image.shape[1])
        if self.shape is not None and self.shape != shape:
            self._warn(
                'size',
                f'the image size changed from {self.shape[1]} x {self.shape[0]} to '
                f'{width} x {height}: everything is reset',
            )
            self._reset()
        self.shape = shape
        boxes = list(self.requested)
        self.requested.clear()
        if self._armed and stamp_ns >= self._initial_stamp_ns:
            self._armed = False
            if self._initial_box is not None and not boxes:
                boxes = [self._initial_box]
        for box in boxes:
            try:
                check_start_box(box, (width, height))
            except InputError as error:
                self._warn('box', f'{error}: it is ignored')
            else:
                self._initialize(box)

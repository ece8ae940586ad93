# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What happens before the tracking: changes of size, and whom tracks start from."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import InputError
from gait_segmentation.geometry import Box, check_start_box


@dataclass
class Intake:
    """
    Watches sizes, and starts tracks.

    Boxes that are ``requested`` start tracks at the next frame: the newest, as many as there are
    slots, since each costs time and more could not be kept.  The initial box does so at the first
    frame that is not earlier than its stamp, and again whenever it is ``armed``.

    :ivar reset: drops all tracks.
    :ivar initialize: starts a track.
    :ivar warn: takes a key and a text.
    :ivar shape: (height, width) of the last frame.
    """

    reset: Callable[[], None]
    initialize: Callable[[Box], None]
    warn: Callable[[str, str], object]
    requested: deque[Box] = field(default_factory=lambda: deque(maxlen=1))
    initial_box: Box | None = None
    initial_stamp_ns: int = 0
    armed: bool = True
    shape: tuple[int, int] | None = None

    def take(self, image: NDArray[np.uint8], stamp_ns: int) -> None:
        """Prepare the stages for a frame, (height, width, 3) uint8."""
        height, width = shape = (image.shape[0], image.shape[1])
        if self.shape not in (None, shape):
            before = '{1} x {0}'.format(*self.shape)
            text = f'the image size changed from {before} to {width} x {height}'
            self.warn('size', f'{text}: everything is reset')
            self.reset()
        self.shape = shape
        if self.armed and stamp_ns >= self.initial_stamp_ns:
            self.armed = False
            if self.initial_box is not None and not self.requested:
                self.requested.append(self.initial_box)
        while self.requested:
            box = self.requested.popleft()
            try:
                check_start_box(box, (width, height))
            except InputError as error:
                self.warn('box', f'{error}: it is ignored')
            else:
                self.initialize(box)

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What happens before the tracking: changes of size, and whom tracks start from."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import GaitSegmentationError, InputError
from gait_segmentation.geometry import Box, check_start_box
from gait_segmentation.inputs.encodings import read_heat_map
from gait_segmentation.streams.fields import stamp_of

if TYPE_CHECKING:
    from gait_segmentation.results import TrackResult
    from gait_segmentation.streams.config import StartConfig


_AHEAD_S = 1.0
"""How far the stamp of a heat map may be ahead of the last image; another clock, if farther."""

_SAME_OVERLAP = 0.3
"""Intersection over union from which two boxes are taken for the same person."""


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


class MapIntake:
    """Lets in the heat maps that are of the images, and says of the others what is wrong."""

    def __init__(
        self, add: Callable[[NDArray[np.uint8], int], object], warn: Callable[[str, str], object]
    ) -> None:
        """Wait for maps; ``add`` takes one and its stamp, ``warn`` a key and a text."""
        self._add = add
        self._warn = warn
        self._image_ns = self._map_ns = 0
        self.in_use = False
        """Whether maps come."""

    def take(self, message: Any, most: int, age_s: float) -> None:
        """Hand on a sensor_msgs/Image of ``most`` pixels and ``age_s`` late at most, or warn."""
        stamp_ns = stamp_of(message.header)
        ahead_s = (stamp_ns - self._image_ns) / 1e9
        if self._image_ns and ahead_s > _AHEAD_S:
            why = f'its stamp is {ahead_s:.3f} s ahead of the last image'
        elif self._image_ns and -ahead_s > age_s:
            why = f'it is {-ahead_s:.3f} s older than the last image (heat_map_age: {age_s:g} s)'
        else:
            try:
                self._add(read_heat_map(message, most), stamp_ns)
            except GaitSegmentationError as error:
                why = str(error)
            else:
                self._map_ns, self.in_use = stamp_ns, True
                return
        self._warn('heat map', f'a heat_map is ignored: {why}')

    def note(self, image_ns: int, age_s: float) -> None:
        """Note the stamp of an image, and warn once if the maps have stopped."""
        self._image_ns = image_ns
        # Those of a slow publisher are no more than late.
        if self.in_use and image_ns - self._map_ns > 1e9 * max(age_s, _AHEAD_S):
            self.in_use = False
            self._warn('no heat map', 'the heat maps have stopped: going on without')


def read_detections(message: Any, config: StartConfig) -> list[Box]:
    """Return the boxes of the people in a vision_msgs/Detection2DArray, the surest first."""
    found = []
    for detection in message.detections:
        scores = [
            float(result.hypothesis.score)
            for result in detection.results
            if config.detection_class in ('', result.hypothesis.class_id)
            # Nor is one that is no number.
            and result.hypothesis.score >= config.detection_score
        ]
        if not scores:
            continue
        center, box = detection.bbox.center.position, detection.bbox
        numbers = map(float, (center.x, center.y, box.size_x, box.size_y))
        with suppress(InputError):  # Without a size.
            found.append((max(scores), Box.from_center(*numbers)))
    return [box for _, box in sorted(found, key=lambda each: -each[0])]


def new_people(
    boxes: Sequence[Box],
    tracks: Sequence[TrackResult],
    slots: int,
    requested: Sequence[Box] = (),
) -> list[Box]:
    """
    Return the boxes to start tracks from: of people who are not tracked, for slots that are free.

    A detector sees the tracked people in every frame; they must not be restarted.  Nor must those
    who are about to start.
    """
    known = [*requested, *(track.box for track in tracks if track.box is not None)]
    free = slots - len(requested) - sum(track.track_id != 0 for track in tracks)
    new: list[Box] = []
    for box in boxes:
        if all(box.iou(each) < _SAME_OVERLAP for each in (*known, *new)):
            new.append(box)
    return new[: max(free, 0)]

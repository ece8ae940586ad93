# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the nodes that find people in the camera's images have in common."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import Image, RegionOfInterest

from gait_segmentation.config import StageConfig
from gait_segmentation.detector.detection import SAME_PERSON
from gait_segmentation.detector.networks import DetectorConfig
from gait_segmentation.detector.scheduler import DetectorScheduler
from gait_segmentation.encodings import read_heat_map, read_image
from gait_segmentation.errors import GaitSegmentationError, InputError
from gait_segmentation.geometry import Box
from gait_segmentation.people import PeopleConfig, slot_name
from gait_segmentation.results import EMPTY, TrackResult
from gait_segmentation.ros.lifecycle import GaitNode
from gait_segmentation.ros.messages import detection_types
from gait_segmentation.ros.qos import BEST_EFFORT, LATCHED
from gait_segmentation.starting import StartingConfig
from gait_segmentation.streams.config import BankConfig, CameraConfig, StartConfig
from gait_segmentation.streams.fields import Parts, stamp_of
from gait_segmentation.streams.intake import Intake
from gait_segmentation.streams.pace import Pace
from gait_segmentation.tracking import TrackingConfig

_AHEAD_S = 1.0
"""How far the stamp of a heat map may be ahead of the last image; another clock, if farther."""


class CameraNode(GaitNode):
    """Tracks people in images: build ends with make_intake, process begins with take_image."""

    groups: ClassVar[Sequence[tuple[str, type[StageConfig]]]] = (
        ('', CameraConfig),
        ('', StartConfig),
        ('', PeopleConfig),
        ('', BankConfig),
        ('tracking', TrackingConfig),
        ('starting', StartingConfig),
        ('detector', DetectorConfig),
    )

    tracks: Sequence[TrackResult] = ()
    """What the diagnostics report."""

    def make_intake(self) -> None:
        """Prepare the intake of frames and first boxes."""
        start = self.parameters.get(StartConfig)
        # First, so that it is known to a matcher before the likelihoods are.
        self._size = self.output(RegionOfInterest, 'image_size', LATCHED)
        self._forget()
        self.intake = Intake(
            reset=self.drop_tracks,
            initialize=self.stage.initialize,
            warn=self.warnings.warn,
            requested=deque(maxlen=self.slots),
            initial_box=start.box(),
            initial_stamp_ns=start.initial_box_stamp,
        )

    def make_scheduler(self) -> DetectorScheduler:
        """Return who looks at whole images in a thread, so that no frame waits for them."""
        self._scheduler = DetectorScheduler(
            self.parameters.get(DetectorConfig), threaded=True, clock=time.perf_counter
        )
        # Before the first frame comes: it takes half a second.
        self._note_error(self._scheduler.load())
        self._pace = Pace()
        return self._scheduler

    def take_image(self, frame: Parts) -> tuple[NDArray[np.uint8], int]:
        """Return image and stamp of a frame, and start the tracks that begin with it (worker)."""
        message, before = frame['image'], self.intake.shape
        camera = self.parameters.get(CameraConfig)
        image = read_image(message, camera.max_pixels, camera.sample_bits)
        stamp_ns = stamp_of(message.header)
        if self.enter(stamp_ns):
            # Start from the initial box again, as in a bag that loops.
            self.intake.armed = True
        self.intake.take(image, stamp_ns)
        self._scheduler.pace = self._pace.update(self.load, time.monotonic())
        seen = self._scheduler.newest
        if seen is not None:
            self._note_error(seen.error)
        if self.intake.shape != before:
            self._size.publish(RegionOfInterest(height=image.shape[0], width=image.shape[1]))
        self.maps.note(stamp_ns, self.parameters.get(TrackingConfig).heat_map_age)
        return image, stamp_ns

    def _note_error(self, error: str) -> None:
        """Note what is wrong with the detector, empty if nothing is, and warn of it."""
        self.trouble = error and f'nobody is found by the detector: {error}'
        if error:
            self.warnings.warn('detector', self.trouble)

    def drop_tracks(self) -> None:
        """Publish what is held back and drop all tracks, but not the boxes that wait."""
        super().drop_tracks()
        self._forget()

    def reset(self) -> None:
        """Drop the boxes that wait for the next frame, too."""
        super().reset()
        self.intake.requested.clear()
        # It is tried again, and what is wrong still holds.
        self._note_error(self._scheduler.load())

    def _forget(self) -> None:
        self.tracks = ()
        self.maps = MapIntake(self.stage.add_heat_map, self.warnings.warn)

    def connect(self) -> None:
        """Subscribe to first boxes and heat maps, and to the camera."""
        self.subscribe(RegionOfInterest, 'init_roi', self._start)
        types = detection_types()
        if types is not None:
            self.subscribe(types.Detection2DArray, 'detections', self._detected)
        # Best effort, which takes messages of every publisher; one that is lost is no harm.
        self.subscribe(Image, 'heat_map', self._heat_map, BEST_EFFORT)
        super().connect()

    def status(self) -> dict[str, str]:
        """Report the track of each slot, what the detector sees, and whether heat maps come."""
        if self.stage is None:
            return {**super().status(), 'people': '0', 'detector': 'none', 'heat map': 'none'}
        tracks, found = self.tracks, {}
        for slot, track in enumerate(tracks):
            known = f'{track.track_id} {track.state} {100 * track.confidence:.0f} %'
            told = track.state if track.state == EMPTY else known
            why = f', {track.reason}' if track.reason else ''
            found[f'track of {slot_name(slot)}'] = told + why
        seen, sees = self._scheduler.newest, 'has not looked'
        if seen is not None:
            sees = seen.error or 'draws a map'
            if seen.people is not None:
                sees = f'sees {len(seen.people)}, {1e3 * seen.seconds:.0f} ms'
        people = str(sum(track.track_id != 0 for track in tracks))
        maps = 'in use' if self.maps.in_use else 'none'
        return {
            **super().status(), 'people': people, **found, 'detector': sees, 'heat map': maps,
        }  # fmt: skip

    def _start(self, message: RegionOfInterest) -> None:
        try:
            box = Box(message.x_offset, message.y_offset, message.width, message.height)
        except GaitSegmentationError as error:
            self.warnings.warn('roi', f'init_roi is ignored: {error}')
            return
        self.later(lambda: self.intake.requested.append(box), 'init_roi', self.slots)

    def _detected(self, message: Any) -> None:
        def start() -> None:
            boxes = read_detections(message, self.parameters.get(StartConfig))
            for box in new_people(boxes, self.tracks, self.slots, self.intake.requested):
                self.intake.requested.append(box)

        # The next message says the same again: only the newest one counts.
        self.later(start, 'detections')

    def _heat_map(self, message: Image) -> None:
        if self.enabled:
            most = self.parameters.get(CameraConfig).max_pixels
            age_s = self.parameters.get(TrackingConfig).heat_map_age
            self.later(lambda: self.maps.take(message, most, age_s), 'heat map', 4)


@dataclass
class MapIntake:
    """
    Lets in the heat maps that are of the images, and says of the others what is wrong.

    :ivar add: takes a map and its stamp.
    :ivar warn: takes a key and a text.
    :ivar in_use: whether maps come.
    """

    add: Callable[[NDArray[np.uint8], int], object]
    warn: Callable[[str, str], object]
    in_use: bool = False
    image_ns: int = 0
    map_ns: int = 0

    def take(self, message: Any, most: int, age_s: float) -> None:
        """Hand on a sensor_msgs/Image of ``most`` pixels and ``age_s`` late at most, or warn."""
        stamp_ns = stamp_of(message.header)
        ahead_s = (stamp_ns - self.image_ns) / 1e9
        try:
            if self.image_ns and ahead_s > _AHEAD_S:
                raise InputError(f'its stamp is {ahead_s:.3f} s ahead of the last image')
            if self.image_ns and -ahead_s > age_s:
                late = f'it is {-ahead_s:.3f} s older than the last image'
                raise InputError(f'{late} (heat_map_age: {age_s:g} s)')
            self.add(read_heat_map(message, most), stamp_ns)
        except GaitSegmentationError as error:
            self.warn('heat map', f'a heat_map is ignored: {error}')
        else:
            self.map_ns, self.in_use = stamp_ns, True

    def note(self, image_ns: int, age_s: float) -> None:
        """Note the stamp of an image, and warn once if the maps have stopped."""
        self.image_ns = image_ns
        # Those of a slow publisher are no more than late.
        if self.in_use and image_ns - self.map_ns > 1e9 * max(age_s, _AHEAD_S):
            self.in_use = False
            self.warn('no heat map', 'the heat maps have stopped: going on without')


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
        if all(box.iou(each) < SAME_PERSON for each in (*known, *new)):
            new.append(box)
    return new[: max(free, 0)]

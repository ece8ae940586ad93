# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The tracking stage: frames in, box and foreground likelihood image out."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.colour import colour_bins
from gait_segmentation.errors import InputError
from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.geometry import Box, compose, scaling
from gait_segmentation.images import Window, check_image, check_stamp, shrink
from gait_segmentation.results import Feedback, TrackResult
from gait_segmentation.starting import Start, estimate_start
from gait_segmentation.tracking.background import BackgroundModel
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.cues import motion_logit, propagation_logit
from gait_segmentation.tracking.ego_motion import Motion, MotionEstimator
from gait_segmentation.tracking.likelihood import likelihood_image, log_ratio
from gait_segmentation.tracking.mean_shift import mean_shift
from gait_segmentation.tracking.person import Person, new_colours
from gait_segmentation.tracking.working import WorkingImage, working_scale, working_shape

__all__ = ['PersonTracker']

_IDENTITY = scaling(1.0)
_MOST_PENDING = 15
"""Frames kept that no feedback has come for."""

_MOTION_GAP = 4
"""Frames between the two that the cue from motion compares."""

_LEAST_MOTION = 0.02
"""Motion of the body relative to the world that the cue needs, in body heights."""

_DILATION = 0.02
"""Margin about the mask that is not learnt as background, in body heights."""


@dataclass
class _Record:
    """One frame, kept until its feedback came and as long as the cue from motion needs it."""

    image: WorkingImage
    camera: NDArray[np.float64] | None
    body: tuple[float, float]
    background: BackgroundModel
    version: int


class PersonTracker:
    """
    Tracks one person from a first box.

    The likelihood learns from the masks that come back through :meth:`learn`; they may come some
    frames late.
    """

    def __init__(self, bank: TemplateBank, config: TrackingConfig | None = None) -> None:
        """
        Make a tracker that tracks nobody.

        :param bank: the templates that the first mask of a person is estimated with.
        """
        self.config = config or TrackingConfig()
        self._bank = bank
        self._last_id = 0
        self._forget()

    def _forget(self) -> None:
        self._pending_box: Box | None = None
        self._source: tuple[int, int] | None = None
        self._stamp_ns = 0
        self._drop_person()

    def _drop_person(self) -> None:
        self._person: Person | None = None
        self._scale = 1.0
        self._shape = (1, 1)
        self._estimator = MotionEstimator()
        self._background = BackgroundModel((1, 1))
        self._version = 0
        self._pending: deque[_Record] = deque()
        self._history: deque[_Record] = deque(maxlen=_MOTION_GAP + 1)

    def reset(self) -> None:
        """Forget everything but the track ids given so far."""
        self._forget()

    def initialize(self, box: Box) -> None:
        """
        Start a new track at the next frame.

        :param box: the tight box of a person, in source pixels.
        """
        self._pending_box = box

    def update(self, image: NDArray[np.uint8], stamp_ns: int) -> TrackResult:
        """
        Take in the next frame.

        A stamp that goes backwards or another image size forgets the person.

        :param image: (H, W, 3) uint8 BGR.
        :raises InputError: if the image is no BGR image, the stamp is not positive or equal to
            the last one, or the box to start from lies outside of the image.
        """
        check_image(image)
        check_stamp(stamp_ns)
        if stamp_ns == self._stamp_ns:
            raise InputError(f'stamps must increase, got {stamp_ns} twice')
        size = (image.shape[0], image.shape[1])
        if stamp_ns < self._stamp_ns or (self._source is not None and size != self._source):
            box = self._pending_box
            self._forget()
            self._pending_box = box
        self._source = size
        self._stamp_ns = stamp_ns
        if self._pending_box is not None:
            box, self._pending_box = self._pending_box, None
            if box.clipped(size[1], size[0]) is None:
                raise InputError(
                    f'box {box} lies outside of the image of {size[1]} x {size[0]} pixels'
                )
            return self._start(image, stamp_ns, box)
        if self._person is None:
            return self._empty(stamp_ns)
        return self._track(image, stamp_ns, self._person)

    def _empty(self, stamp_ns: int) -> TrackResult:
        assert self._source is not None
        scale = working_scale(
            *self._source, working_size=self.config.working_size, person_height=1, working_height=1
        )
        shape = working_shape(*self._source, scale)
        return TrackResult(stamp_ns, 0, None, np.zeros(shape, np.uint8), 0.0)

    def _start(self, image: NDArray[np.uint8], stamp_ns: int, box: Box) -> TrackResult:
        self._drop_person()
        config = self.config
        height, width = image.shape[:2]
        self._scale = working_scale(
            height,
            width,
            working_size=config.working_size,
            person_height=box.height,
            working_height=config.working_height,
        )
        self._shape = working_shape(height, width, self._scale)
        frame = WorkingImage.of(image, stamp_ns, self._shape)
        margin = config.box_margin
        inner = box.padded(-margin * box.width, -margin * box.height)
        start = estimate_start(
            frame.lab,
            inner.scaled(self._scale),
            self._bank,
            height=config.start_height,
            rounds=config.start_rounds,
        )
        self._last_id += 1
        self._person = person = self._new_person(start)
        self._background = BackgroundModel(self._shape)
        person.learn_colours(frame.lab, start.mask, None, 1.0)
        self._estimator.update(frame.gray, None, None)
        record = _Record(frame, None, (0.0, 0.0), self._background, self._version)
        return self._judge(person, record, start)

    def _new_person(self, start: Start) -> Person:
        return Person(
            self._last_id,
            start.body.center_x,
            start.body.center_y,
            start.body.height,
            max(start.body.center_x - start.box.x, 1.0),
            max(start.box.right - start.body.center_x, 1.0),
            start.mask,
            *new_colours(self.config),
        )

    def _track(self, image: NDArray[np.uint8], stamp_ns: int, person: Person) -> TrackResult:
        frame = WorkingImage.of(image, stamp_ns, self._shape)
        people = np.zeros(self._shape, np.uint8)
        people[person.area.slices(self._shape[1], self._shape[0])] = 1
        motion = self._estimator.update(
            frame.gray, people, self._carried_mask(), camera=self.config.use_ego_motion
        )
        body = person.predict(_world_shift(motion, person), motion.body)
        background = self._background_now(motion.camera)
        record = _Record(frame, motion.camera, body, background, self._version)
        return self._judge(person, record, None)

    def _judge(self, person: Person, record: _Record, start: Start | None) -> TrackResult:
        """Compute the likelihood of a frame, refine the box by it, and file the frame."""
        config = self.config
        self._pending.append(record)
        self._history.append(record)
        frame = record.image
        window = person.window(self._shape)
        if window[0].start >= window[0].stop or window[1].start >= window[1].stop:
            return self._result(person, frame.stamp_ns, np.zeros(self._shape, np.uint8), 0.0)
        lab = np.ascontiguousarray(frame.lab[window])
        logit = log_ratio(
            lab,
            colour_bins(lab),
            person.rows(window),
            window,
            record.background,
            person.person,
            person.surroundings,
            config,
        )
        if config.use_motion_cue:
            self._add_motion(logit, person, record, window)
        to_now = self._body_since_mask()
        if config.use_propagation or start is not None:
            logit += np.float32(config.propagation_weight) * propagation_logit(
                person.mask, to_now, window, person.height
            )
        likelihood = likelihood_image(logit, window, self._shape)
        confidence = self._refine(person, record, likelihood)
        if len(self._pending) > _MOST_PENDING:
            self._absorb(self._pending.popleft())
        return self._result(person, frame.stamp_ns, likelihood, confidence)

    def _result(
        self, person: Person, stamp_ns: int, likelihood: NDArray[np.uint8], confidence: float
    ) -> TrackResult:
        box = person.box.scaled(1 / self._scale)
        return TrackResult(stamp_ns, person.track_id, box, likelihood, confidence, person.angle)

    def _refine(self, person: Person, record: _Record, likelihood: NDArray[np.uint8]) -> float:
        """Shift the box by mean shift on the likelihood; return how well the person stands out."""
        part = person.window(self._shape)
        mask = self._carried_mask()[part]
        values = likelihood[part]
        box = person.box.shifted(-part[1].start, -part[0].start)
        shift = mean_shift(
            values,
            mask,
            (round(box.x), round(box.y), max(round(box.width), 1), max(round(box.height), 1)),
        )
        gain = self.config.mean_shift_gain
        limit = 0.05 * person.height
        dx = gain * min(max(shift.dx, -limit), limit)
        dy = gain * min(max(shift.dy, -limit), limit)
        person.shift(dx, dy)
        record.body = (record.body[0] + dx, record.body[1] + dy)
        if len(self._pending) > 1:
            # The last mask is not of the last frame: until a newer one comes, this is the size.
            person.follow_scale(shift.scale)
        inside = cv2.mean(values, mask)[0]
        outside = cv2.mean(values, cv2.bitwise_not(mask))[0]
        return max(0.0, inside - outside) / 255

    def _add_motion(
        self, logit: NDArray[np.float32], person: Person, record: _Record, window: Window
    ) -> None:
        if len(self._history) <= _MOTION_GAP:
            return
        later = list(self._history)[1:]
        camera = _chain(later)
        dx, dy = _total_shift(later)
        body = np.array([[1.0, 0.0, dx], [0.0, 1.0, dy]])
        center = np.array([person.center_x, person.center_y])
        stays = camera[:, :2] @ (center - (dx, dy)) + camera[:, 2]
        if np.hypot(*(center - stays)) < _LEAST_MOTION * person.height:
            return
        earlier = self._history[0].image.gray
        logit += np.float32(self.config.motion_weight) * motion_logit(
            record.image.gray, earlier, camera, body, window
        )

    def learn(self, feedback: Feedback) -> None:
        """
        Learn from the mask of an earlier frame.

        Feedback for frames no longer kept, or of another track, is ignored.

        :raises InputError: if the mask does not have the source's size.
        """
        person = self._person
        if person is None or feedback.track_id != person.track_id:
            return
        if all(each.image.stamp_ns != feedback.stamp_ns for each in self._pending):
            return
        if feedback.mask.shape != self._source or feedback.mask.dtype != np.uint8:
            raise InputError(
                f'mask must be uint8 of the source size {self._source}, got '
                f'{feedback.mask.shape} {feedback.mask.dtype}'
            )
        record = self._pending.popleft()
        while record.image.stamp_ns != feedback.stamp_ns:
            self._absorb(record)
            record = self._pending.popleft()
        self._learn(person, record, feedback)

    def _learn(self, person: Person, record: _Record, feedback: Feedback) -> None:
        mask = feedback.mask
        if mask.shape != self._shape:
            small = shrink(mask, self._shape)
            mask = np.where(small > 127, 255, 0).astype(np.uint8)
        prior = feedback.shape_prior
        if prior.shape != self._shape:
            prior = cv2.resize(prior, self._shape[::-1], interpolation=cv2.INTER_LINEAR)
        self._adopt_background(record)
        if not person.teaches(mask, prior):
            return
        dx, dy = _total_shift(self._pending)
        person.shift(-dx, -dy)
        lab = record.image.lab
        person.learn_colours(lab, mask, prior, self.config.colour_rate)
        if self.config.use_background:
            size = 2 * max(1, round(_DILATION * person.height)) + 1
            kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
            grown = cv2.dilate(mask, kernel)
            self._background.measure_noise(lab, grown, person.window(self._shape))
            self._background.learn(lab, grown)
        body = None if feedback.body is None else feedback.body.scaled(self._scale)
        person.learn_place(mask, body)
        if self.config.use_tilt:
            person.learn_angle(mask)
        person.mask = mask
        person.shift(dx, dy)

    def _background_now(self, newest: NDArray[np.float64] | None) -> BackgroundModel:
        """Return the background model as it looks in the newest frame."""
        return self._background.moved([*(each.camera for each in self._pending), newest])

    def _adopt_background(self, record: _Record) -> None:
        """Carry the background model to the frame of a record that is learnt next."""
        if record.version == self._version:
            self._background = record.background
        else:
            self._background.move(record.camera)
        self._version += 1

    def _absorb(self, record: _Record) -> None:
        """Let go of a frame that is never learnt: only its motion counts."""
        self._background.move(record.camera)
        person = self._person
        if person is not None:
            person.mask = _shifted(person.mask, *record.body)

    def _body_since_mask(self) -> NDArray[np.float64]:
        dx, dy = _total_shift(self._pending)
        return np.array([[1.0, 0.0, dx], [0.0, 1.0, dy]])

    def _carried_mask(self) -> NDArray[np.uint8]:
        assert self._person is not None
        motion = self._body_since_mask()
        return _shifted(self._person.mask, float(motion[0, 2]), float(motion[1, 2]))


def _world_shift(motion: Motion, person: Person) -> tuple[float, float]:
    x, y = motion.carry(person.center_x, person.center_y)
    return x - person.center_x, y - person.center_y


def _total_shift(records: Iterable[_Record]) -> tuple[float, float]:
    """Return how far the body went over several frames."""
    shifts = [each.body for each in records]
    return sum(dx for dx, _ in shifts), sum(dy for _, dy in shifts)


def _chain(records: list[_Record]) -> NDArray[np.float64]:
    """Return the camera's motion over several frames."""
    total = _IDENTITY
    for each in records:
        if each.camera is not None:
            total = compose(each.camera, total)
    return total


def _shifted(mask: NDArray[np.uint8], dx: float, dy: float) -> NDArray[np.uint8]:
    """Return a mask shifted by whole pixels."""
    step_x, step_y = round(dx), round(dy)
    if step_x == 0 and step_y == 0:
        return mask
    matrix = np.array([[1.0, 0.0, step_x], [0.0, 1.0, step_y]])
    return np.asarray(cv2.warpAffine(mask, matrix, mask.shape[::-1], flags=cv2.INTER_NEAREST))

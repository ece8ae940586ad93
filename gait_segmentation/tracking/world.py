# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What all people of about one size share: working image, camera motion and background."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from copy import deepcopy

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import Box, body_window
from gait_segmentation.heat_maps import HeatMap
from gait_segmentation.images import Window, shifted_part
from gait_segmentation.scene.background import BackgroundModel
from gait_segmentation.scene.ego_motion import MotionEstimator
from gait_segmentation.scene.light import Contrast, Light
from gait_segmentation.scene.working import WorkingImage, working_scale, working_shape
from gait_segmentation.scene.world_motion import WorldMotion
from gait_segmentation.tracking.competition import REACH
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.records import Record, Shift, add_moving, body_over

_MOST_PENDING = 15
"""Frames kept that no feedback has come for."""

_MOTION_GAP = 4
"""Frames between the two that the cue from motion compares."""

_SMALLEST, _LARGEST = 0.7, 2.0
"""Heights, over the working height, of the people who share a world."""

_LEAST_SHOWN = 0.1
"""Share of the known background below which a frame shows something else."""


class World:
    """
    The surroundings as seen at one working scale.

    Everything in it is done once a frame, for however many people.  Masks come back frames after
    their image: the background is that of the last frame that was taken, from which each newer
    one gets a model of its own, in one step for however many motions, since each step blurs.
    """

    def __init__(self, source: tuple[int, int], height: float, config: TrackingConfig) -> None:
        """
        Make a world of which nothing is known, for a person of some height in source pixels.

        :param source: (H, W) of the source images.
        """
        self.scale, largest = (
            working_scale(
                *source,
                working_size=config.working_size,
                person_height=person_height,
                working_height=config.working_height,
            )
            for person_height in (height, 1.0)
        )
        self.source, self.shape = source, working_shape(*source, self.scale)
        self._at_largest = self.scale >= largest
        self._working_height = config.working_height
        self._estimator = MotionEstimator()
        self.config = config
        self.see_as(Light(), Contrast())
        self._background = BackgroundModel(self.shape)
        self.fades = False
        """Whether the newest frame is the first without colours after those that had some."""

        self.pending: deque[Record] = deque()
        self.history: deque[Record] = deque(maxlen=_MOTION_GAP + 1)

    def see_as(self, light: Light, contrast: Contrast) -> None:
        """Take over light and levels of somebody who has seen the place before."""
        self._light, self._contrast = deepcopy(light), contrast
        self._light.flickers = self.config.use_flicker

    def fits(self, height: float) -> bool:
        """Return whether a person of the given height in source pixels is well seen here."""
        height *= self.scale / self._working_height
        return height <= _LARGEST and (self._at_largest or height >= _SMALLEST)

    @property
    def now(self) -> Record:
        """Return the newest frame."""
        return self.history[-1]

    @property
    def step_s(self) -> float:
        """Return the seconds between the last two frames, 0 at the first."""
        if len(self.history) < 2:
            return 0.0
        return (self.history[-1].image.stamp_ns - self.history[-2].image.stamp_ns) / 1e9

    def gap_s(self, stamp_ns: int) -> float:
        """Return the seconds from the newest frame to a stamp, 0 without a frame."""
        return (stamp_ns - self.now.image.stamp_ns) / 1e9 if self.history else 0.0

    def advance(
        self,
        image: NDArray[np.uint8],
        stamp_ns: int,
        areas: Sequence[Box],
        *,
        camera: bool,
        texture: bool = True,
        everywhere: bool = False,
        heat: HeatMap | None = None,
    ) -> WorldMotion:
        """
        Take in a frame.

        :param image: (H, W, 3) uint8 BGR.
        :param areas: where people were in the last frame, in working pixels; the background is
            followed and learnt about them, with none everywhere.
        :param camera: whether to measure the motion of the camera.
        :param texture: whether gradient energy stands for the colours that grey images lack.
        :param everywhere: whether to follow the background everywhere all the same.
        :param heat: P(person) from elsewhere, of this frame or one before.
        :returns: what moved; :meth:`body_shift` then measures the people.
        """
        light = self._light if self.config.use_light else None
        contrast = self._contrast if self.config.use_contrast else None
        frame = WorkingImage.of(image, stamp_ns, self.shape, light, contrast, texture=texture)
        self.fades = (
            self.config.use_fade and frame.faded and not (self.history and self.now.image.faded)
        )
        if self.fades:
            models = [self._background, *(each.background for each in self.pending)]
            for model in {id(each): each for each in models}.values():
                model.fade(frame.textured)
        people = np.zeros(self.shape, np.uint8)
        for area in areas:
            people[area.slices(self.shape[1], self.shape[0])] = 1
        motion = self._estimator.update(frame.pyramid, people, camera=camera)
        windows = windows_about([] if everywhere else areas, motion, self.shape)
        steps = [each.motion for each in self.pending]
        background = self._background.moved([*steps, motion], windows)
        blank, shown = frame.pyramid.is_blank, None
        if windows and not blank:
            shown = background.agreement(frame.lab, people, windows)
        if shown is not None and shown < _LEAST_SHOWN:
            if self.history and frame.pyramid.resembles(self.history[-1].image.pyramid):
                self._begin_anew(background)
            else:
                blank, motion = True, WorldMotion()
                self._estimator.leave_out()
                background = self._background.moved(steps, windows)
        if not blank:
            self._light.follow(motion, people)
        record = Record(frame, motion, background, windows, blank=blank)
        self.pending.append(record)
        self.history.append(record)
        if heat is not None and heat.stamp_ns >= self.history[0].image.stamp_ns:
            size = self.shape[::-1]
            record.heat = np.asarray(cv2.resize(heat.values, size, interpolation=cv2.INTER_LINEAR))
            # It is of the frame that is nearest to its stamp.
            ages = [abs(each.image.stamp_ns - heat.stamp_ns) for each in self.history]
            record.heat_frames = len(ages) - 1 - ages.index(min(ages))
        return motion

    def _begin_anew(self, background: BackgroundModel) -> None:
        """Forget the place, for the camera shows another one from now on."""
        self._light.forget()
        for model in (self._background, background):
            model.sums[:] = 0
        self.history.clear()
        for each in self.pending:
            each.blank = each.outdated = True

    def body_shift(
        self, body: NDArray[np.uint8], window: Window, velocity: Shift = (0.0, 0.0)
    ) -> Shift | None:
        """
        Return how far a body went from the last frame to this one, None if it cannot be seen.

        :param body: (h, w) uint8 of a window, non-zero on the person in the last frame.
        :param velocity: shift against the still world that is expected.
        """
        corner = window[0].start, window[1].start
        return self._estimator.body_shift(body, self.now.motion, velocity, corner)

    def clear(self, where: NDArray[np.uint8]) -> None:
        """
        Forget what the surroundings look like somewhere: a person turned out to stand there.

        :param where: (h, w) uint8, non-zero where to forget.
        """
        for model in (self._background, self.now.background):
            model.forget(where)
        self._outdate()

    def adopt(self, known: BackgroundModel) -> None:
        """
        Take over what is known of the surroundings from elsewhere, where less is known here.

        :param known: as it looks in the newest frame.
        """
        self.now.background.adopt(known)
        if self.now.background is not self._background:
            back = WorldMotion.over(each.motion for each in self.pending).inverse()
            self._background.adopt(known.moved([back]))
        self._outdate()

    def _outdate(self) -> None:
        """Let none of the frames before the newest bring back what it looked like in them."""
        if len(self.pending) > 1:
            for each in self.pending:
                each.outdated = True

    def motions_of(self, track_id: int) -> tuple[Record, WorldMotion, Shift] | None:
        """
        Return how world and body moved over the last frames in which a track was there.

        :returns: the first of these frames, and from it to the newest the motion of the world
            and the shift of the body; None if there is but one frame, or the first is blank.
        """
        frames = [each for each in self.history if track_id in each.bodies]
        if len(frames) < 2 or frames[0].blank:
            return None
        first, *since = frames
        motion = WorldMotion.over(each.motion for each in since)
        return first, motion, body_over(since, track_id)

    def body_since(self, track_id: int, frames: int) -> Shift:
        """Return how far a body went over the last frames, at most those that are kept."""
        return body_over(list(self.history)[len(self.history) - frames :], track_id)

    def since_mask(self, track_id: int) -> Shift:
        """Return how far a body went since the last frame that was learnt."""
        return body_over(self.pending, track_id)

    def carried(
        self, image: NDArray[np.uint8], track_id: int, window: Window
    ) -> NDArray[np.uint8]:
        """
        Return a window of an image of the last frame that was learnt, carried along with a body.

        :param image: (h, w) uint8 of the working image; what is returned may be a part of it.
        """
        dx, dy = self.since_mask(track_id)
        return shifted_part(image, round(dx), round(dy), window)

    def drop_old(self) -> list[Record]:
        """Let go of frames that feedback has not come for in time; return them."""
        dropped = []
        while len(self.pending) > _MOST_PENDING:
            dropped.append(self._skip())
        return dropped

    def take(self, stamp_ns: int) -> tuple[list[Record], Record | None]:
        """
        Take the frame of a stamp out of those that are kept, to learn from it.

        :returns: the older ones, which are never learnt, and the frame; None if it is not kept.
        """
        if all(each.image.stamp_ns != stamp_ns for each in self.pending):
            return [], None
        skipped = []
        while self.pending[0].image.stamp_ns != stamp_ns:
            skipped.append(self._skip())
        record = self.pending.popleft()
        if record.outdated:
            self._background = self._background.moved([record.motion], record.windows)
        else:
            self._background = record.background
        for each in self.pending:
            each.outdated = True
        return skipped, record

    def learn(
        self,
        record: Record,
        people: NDArray[np.uint8],
        around: Sequence[Window],
        *,
        gate: bool = True,
    ) -> None:
        """
        Learn the background from a frame just taken, unless nothing can be seen in it.

        :param people: (h, w) uint8, non-zero where people may be.
        :param around: windows about people, in which the noise is measured.
        :param gate: whether to leave out what moves against the world.
        """
        record.people = people
        if record.blank:
            return
        lab, background = record.image.lab, self._background
        background.measure_noise(lab, people, around)
        if gate:
            people = people.copy()
            add_moving(people, record, self.history, background.sigma)
        background.learn(lab, people, record.windows)

    def _skip(self) -> Record:
        record = self.pending.popleft()
        self._background = self._background.moved([record.motion], record.windows)
        return record


def windows_about(
    areas: Iterable[Box], motion: WorldMotion, shape: tuple[int, int]
) -> list[Window]:
    """
    Return disjoint windows with room about people, as the camera moved them.

    :param areas: where people were in the last frame, in pixels.
    :param motion: of the world since.
    :param shape: (h, w) of the image; all of it is the window if there are no people.
    """
    height, width = shape
    boxes: list[Box] = []
    for area in areas:
        x, y = motion.carry(area.center_x, area.center_y)
        # Farther than pixels are judged: known before the person comes there.
        ahead = REACH * area.height
        box = body_window(x, y, area.height).padded(ahead, ahead)
        while touching := [other for other in boxes if other.iou(box) > 0]:
            boxes = [other for other in boxes if other not in touching]
            for other in touching:
                box = box.union(other)
        boxes.append(box)
    if not boxes:
        return [(slice(0, height), slice(0, width))]
    windows = (box.slices(width, height) for box in boxes)
    return [w for w in windows if w[0].start < w[0].stop and w[1].start < w[1].stop]

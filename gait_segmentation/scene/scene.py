# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The place before one camera: its light, how the camera moves, and what is there without people.

There is one scene from the first image of a stream on.  Light and camera motion are measured once
a frame, at the finest scale in use; people of other sizes have views of it at scales of their own.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import REACH, Box, body_window
from gait_segmentation.heat_maps import HeatMap
from gait_segmentation.images import Window
from gait_segmentation.scene.background import SURE_COUNT, BackgroundModel
from gait_segmentation.scene.ego_motion import MotionEstimator, WorldMotion
from gait_segmentation.scene.working import Contrast, Light, WorkingImage, working_shape

Shift = tuple[float, float]
Expected = tuple[BackgroundModel, list[Window]]
"""What a frame should show of the background, and the windows in which it is known."""

MOST_KEPT = 16  # frames, for masks that come late
MOTION_GAP = 4  # frames between the two that motion is seen by
_LEAST_SHOWN = 0.1  # share of the known background below which a frame shows something else
_LEARNT_GAP = 3  # frames between the two that tell what moves and is not learnt
# Change that is motion: grey levels, and spreads of a still pixel on top.
_MOTION_LEVELS = 6.0
_MOTION_SPREADS = 2.0
# What is left of the count of a pixel that looks otherwise although nothing moves there.
_FADE = 0.5
# Side of the squares that changes are averaged over and that motion is widened by.
_CHANGED_PX = 5


@dataclass(frozen=True, eq=False)
class Frame:
    """
    One frame at one scale, kept until its masks have come.

    ``motion`` is how the still world moved since the frame before.  ``windows`` are the parts in
    which the background is known and learnt, disjoint.  ``blank`` tells that nothing of the scene
    can be seen: something covers the lens, the picture is damaged, or it shows another place.
    """

    image: WorkingImage
    motion: WorldMotion
    windows: list[Window]
    blank: bool = False


@dataclass(frozen=True)
class Regions:
    """
    Where people were in the last frame of a view, in working pixels.

    The background is followed and learnt about them, or all over the image if there are none or
    they may be ``everywhere``.
    """

    areas: tuple[Box, ...] = ()
    everywhere: bool = False


NOWHERE = Regions()


class ShownHeat(NamedTuple):
    """
    A heat map at the scale of a view: (h, w) uint8, P(person) as others see it.

    It is of ``frames`` before the newest one, and counts as far as ``trust`` says (0..1).
    """

    values: NDArray[np.uint8]
    frames: int
    trust: float


class View:
    """The scene at one scale, with the ``background`` as it looks in the newest frame."""

    def __init__(self, source: tuple[int, int], scale: float) -> None:
        """Begin with nothing known of (H, W) images; ``scale`` is from these to working pixels."""
        self.source, self.scale = source, scale
        self.shape = working_shape(*source, scale)
        self.background = BackgroundModel(self.shape)
        self.frames: deque[Frame] = deque(maxlen=MOST_KEPT)
        self.heat: ShownHeat | None = None
        """The heat map that counts in the newest frame, if there is one."""

        self.points = MotionEstimator()
        self._learnt: Frame | None = None
        self._people = deque[tuple[Frame, NDArray[np.uint8]]](maxlen=MOST_KEPT)

    @property
    def all(self) -> Window:
        """Return all rows and columns."""
        return slice(0, self.shape[0]), slice(0, self.shape[1])

    @property
    def now(self) -> Frame:
        """Return the newest frame."""
        return self.frames[-1]

    @property
    def step_s(self) -> float:
        """Return the seconds between the last two frames, 0 at the first."""
        if len(self.frames) < 2:
            return 0.0
        return (self.frames[-1].image.stamp_ns - self.frames[-2].image.stamp_ns) / 1e9

    def take(self, stamp_ns: int) -> Frame | None:
        """Return the frame of a stamp to learn from; None if it, or a newer one, is learnt."""
        for frame in reversed(self.frames):
            if frame is self._learnt:
                return None
            if frame.image.stamp_ns == stamp_ns:
                self._learnt = frame
                while len(self.frames) > MOTION_GAP + 1 and self.frames[0] is not frame:
                    self.frames.popleft()
                return frame
        return None

    def people_in(self, frame: Frame) -> NDArray[np.uint8] | None:
        """Return where people were, (h, w) uint8, non-zero there, None if no mask has come."""
        return next((people for each, people in self._people if each is frame), None)

    def motion_since(self, frame: Frame, until: Frame | None = None) -> WorldMotion:
        """Return how the still world moved from a frame that is kept to another, or the newest."""
        frames = list(self.frames)
        end = len(frames) if until is None else frames.index(until) + 1
        return WorldMotion.over(each.motion for each in frames[frames.index(frame) + 1 : end])

    def marked(self, areas: Iterable[Box]) -> NDArray[np.uint8]:
        """Return areas in working pixels as an image, (h, w) uint8, 1 there."""
        people = np.zeros(self.shape, np.uint8)
        for area in areas:
            people[area.slices(self.shape[1], self.shape[0])] = 1
        return people

    def expected(self, motion: WorldMotion, where: Regions) -> Expected:
        """Return what is expected of the next frame."""
        windows = windows_about(() if where.everywhere else where.areas, motion, self.shape)
        return self.background.moved([motion], windows), windows

    def share_shown(self, image: WorkingImage, expected: Expected, where: Regions) -> float:
        """Return the share of what is expected that a frame shows, 1 if few pixels tell."""
        if image.pyramid.is_blank:
            return 1.0
        background, windows = expected
        return background.agreement(image.lab, self.marked(where.areas), windows)

    def accept(
        self,
        image: WorkingImage,
        motion: WorldMotion,
        expected: Expected,
        *,
        blank: bool,
    ) -> None:
        """Take in a frame, and what was :meth:`expected` of it; see :class:`Frame`."""
        background, windows = expected
        if not blank:
            self.background = background
        self.frames.append(Frame(image, motion, windows, blank))
        self.heat = None

    def show(self, heat: HeatMap | None) -> None:
        """Let a heat map count in the newest frame, if it is of that or of one shortly before."""
        stamps = [each.image.stamp_ns for each in [*self.frames][-MOTION_GAP - 1 :]]
        if heat is None or heat.stamp_ns < stamps[0]:
            return
        values = cv2.resize(heat.values, self.shape[::-1], interpolation=cv2.INTER_LINEAR)
        # It is of the frame that is nearest to its stamp.
        ages = [abs(stamp_ns - heat.stamp_ns) for stamp_ns in stamps]
        age = len(ages) - 1 - ages.index(min(ages))
        self.heat = ShownHeat(np.asarray(values), age, heat.trust)

    def clear(self) -> None:
        """Forget the place, for the camera shows another one from now on."""
        self.background.sums[:] = 0
        self.frames.clear()

    def add_background(
        self,
        frame: Frame,
        people: NDArray[np.uint8],
        around: Sequence[Window],
        *,
        gate: bool = True,
    ) -> None:
        """
        Learn the background from a frame that is kept, unless nothing can be seen in it.

        :param people: (h, w) uint8, non-zero where people may be in it.
        :param around: windows in which the noise is measured.
        :param gate: whether to leave out what moves against the world.
        """
        self._people.append((frame, people))
        if frame.blank:
            return
        lab, motion, windows = frame.image.lab, self.motion_since(frame), frame.windows
        hidden = people.copy()
        if motion.camera is not None:
            # The mask came late: the frame is moved on to where the background is by now.
            windows = around = self.now.windows
            earlier, lab = lab, np.zeros_like(lab)
            for window in windows:
                lab[window] = motion.warped(earlier, window)
            people = _hidden_after(motion, people, windows)
        self.background.measure_noise(lab, people, around)
        if gate:
            self._add_moving(hidden, frame)
        if motion.camera is not None:
            hidden = _hidden_after(motion, hidden, windows)
        self.background.add(lab, hidden, windows)

    def _add_moving(self, people: NDArray[np.uint8], frame: Frame) -> None:
        """Add to people, (h, w) uint8, what else moves against the world."""
        frames = list(self.frames)
        earlier = frames[max(0, frames.index(frame) - _LEARNT_GAP)]
        if earlier is frame:
            return
        motion = self.motion_since(earlier, frame)
        gray = frame.image.gray
        for window in frame.windows:
            then = motion.warped(earlier.image.gray, window)
            moving = moving_pixels(gray[window], then, self.background.sigma)
            if (before := self.people_in(earlier)) is not None:
                # What people have just uncovered has changed but is background.
                left = motion.warped(before, window, cv2.BORDER_CONSTANT)
                moving &= cv2.inRange(left, 0, 0)
            people[window] |= moving


class WholeView(View):
    """The scene all over the image; its background moves only when learnt, as motion blurs it."""

    def __init__(self, source: tuple[int, int], scale: float) -> None:
        """Make a view of which nothing is known; see :class:`View`."""
        super().__init__(source, scale)
        self._since = WorldMotion()
        self.clear()

    def expected(self, motion: WorldMotion, where: Regions) -> Expected:
        """Return the background as it was learnt, of all of the image."""
        self._since = WorldMotion.over([self._since, motion])
        return self.background, [self.all]

    def share_shown(self, image: WorkingImage, expected: Expected, where: Regions) -> float:
        """Return 1: its background stays where it was learnt."""
        return 1.0

    def clear(self) -> None:
        """Forget the place."""
        self.background, self._since = BackgroundModel(self.shape), WorldMotion()
        self._smooth = self.background.sums
        self.is_known = False
        """Whether anything has been learnt."""

    def known(self, shape: tuple[int, int]) -> BackgroundModel:
        """Return the background in the newest frame for an image of (h, w)."""
        background = self.background.moved([self._since])
        return background if shape == self.shape else background.resized(shape)

    def smoothed(self) -> BackgroundModel:
        """Return the background in the newest frame, blurred by 3 x 3 pixels."""
        sums = self._since.warped(self._smooth, self.all, cv2.BORDER_CONSTANT)
        return self.background.with_sums(sums)

    def add_all(self, hidden: NDArray[np.uint8]) -> None:
        """Learn the newest frame, but what is not zero in ``hidden``, (h, w) uint8."""
        self.background = model = self.background.moved([self._since])
        self._since, lab = WorldMotion(), self.now.image.lab
        model.measure_noise(lab, hidden, [self.all])
        # What has left or has come to stay is no mean with what was there before: the longer
        # that was seen, the longer it must be missed.
        other = (model.contradicted(lab, 1.0) > 0) & (hidden == 0)
        model.forget(other, _FADE)
        gone = other & (model.count < SURE_COUNT)
        model.forget(gone)
        model.add(lab, np.where(other & ~gone, np.uint8(1), hidden))
        self._smooth, self.is_known = np.asarray(cv2.blur(model.sums, (3, 3))), True


@dataclass(frozen=True)
class SceneOptions:
    """
    What is measured of a scene: camera motion, light with its flicker, and colours that fade.

    ``texture`` lets gradient energy stand for the colours that grey images lack, ``contrast``
    spreads the levels of pictures that use few.
    """

    camera: bool = True
    texture: bool = True
    light: bool = True
    flicker: bool = True
    fade: bool = True
    contrast: bool = True


class Scene:
    """
    What is known of the place, whoever is tracked in it.

    ``views`` are those in use.  ``moving`` is (h, w) uint8 of any size, non-zero where something
    moved in the last frame, None if that is not known.  ``fades`` tells that the newest frame is
    the first without colours after those that had some.
    """

    def __init__(self, source: tuple[int, int]) -> None:
        """Make a scene of which nothing is known; ``source`` is (H, W) of its images."""
        self.source = source
        self.views: list[View] = []
        self.moving: NDArray[np.uint8] | None = None
        self.fades = False
        self.stamp_ns = 0
        self._options = SceneOptions()
        self._light, self._contrast = Light(), Contrast()

    def gap_s(self, stamp_ns: int) -> float:
        """Return the seconds from the newest frame to a stamp, 0 without a frame."""
        return (stamp_ns - self.stamp_ns) / 1e9 if self.stamp_ns else 0.0

    def advance(
        self,
        image: NDArray[np.uint8],
        stamp_ns: int,
        people: Mapping[View, Regions] = MappingProxyType({}),
        *,
        options: SceneOptions = SceneOptions(),
    ) -> None:
        """
        Take in a frame.

        :param image: (H, W, 3) uint8 BGR; it is read again when a view is added.
        :param people: where they were in the last frame, by view.
        """
        self._frame, self._options = (image, stamp_ns), options
        self._heat: HeatMap | None = None
        self._light.flickers = options.flicker
        self.stamp_ns, self.fades = stamp_ns, False
        if not self.views:
            return
        leader = max(self.views, key=lambda view: view.scale)
        faded = bool(leader.frames) and leader.now.image.faded
        newest = self._image(leader.shape, measure=True)
        hidden = self._hidden(leader, people)
        motion = leader.points.update(newest.pyramid, hidden if options.camera else None)
        images, steps = self._in_all_views(leader, newest, motion)
        self.fades = options.fade and newest.faded and not faded
        if self.fades:
            for view in self.views:
                view.background.fade(newest.textured)
        regions = [people.get(view, NOWHERE) for view in self.views]
        expected = [
            view.expected(step, where)
            for view, step, where in zip(self.views, steps, regions, strict=True)
        ]
        shown = [
            view.share_shown(images[view.shape], each, where)
            for view, each, where in zip(self.views, expected, regions, strict=True)
        ]
        blank = newest.pyramid.is_blank
        if min(shown) < _LEAST_SHOWN:
            if leader.frames and newest.pyramid.resembles(leader.now.image.pyramid):
                self._light.forget()
                for view in self.views:
                    view.clear()
                expected = [
                    (view.background, windows)
                    for view, (_, windows) in zip(self.views, expected, strict=True)
                ]
            else:
                blank, steps = True, [WorldMotion()] * len(steps)
                for view in self.views:
                    view.points.leave_out()
        if not blank:
            self._light.follow(motion, hidden)
        for view, step, each in zip(self.views, steps, expected, strict=True):
            view.accept(images[view.shape], step, each, blank=blank)

    def _in_all_views(
        self, leader: View, newest: WorkingImage, motion: WorldMotion
    ) -> tuple[dict[tuple[int, int], WorkingImage], list[WorldMotion]]:
        """Return the newest image at the sizes of all views, and how the world moved in each."""
        images, steps = {leader.shape: newest}, []
        for view in self.views:
            if view.shape not in images:
                images[view.shape] = self._image(view.shape)
            if view is not leader:
                view.points.update(images[view.shape].pyramid, None)
            down, across = (a / b for a, b in zip(view.shape, leader.shape, strict=True))
            steps.append(motion if view is leader else motion.scaled(across, down))
        return images, steps

    def show(self, heat: HeatMap | None) -> None:
        """Let a heat map count in the newest frame, if it is of that or of one shortly before."""
        self._heat = heat
        for view in self.views:
            view.show(heat)

    def add(self, view: View) -> None:
        """Take in a view, and show it the newest frame."""
        first, still = not self.views, WorldMotion()
        image = self._image(view.shape, measure=first)
        view.points.update(image.pyramid, None)
        if first and not image.pyramid.is_blank:
            self._light.follow(still, np.zeros(view.shape, np.uint8))
        expected = view.expected(still, NOWHERE)
        view.accept(image, still, expected, blank=image.pyramid.is_blank)
        view.show(self._heat)
        self.views.append(view)

    def keep(self, views: Collection[View]) -> None:
        """Let go of all other views, but of that in which people are looked for."""
        self.views = [view for view in self.views if view in views or isinstance(view, WholeView)]

    def _hidden(self, leader: View, people: Mapping[View, Regions]) -> NDArray[np.uint8]:
        """Return where people and what else moves were in the last frame, (h, w) uint8."""
        hidden = leader.marked(
            area.scaled(leader.scale / view.scale)
            for view, where in people.items()
            for area in where.areas
        )
        if self.moving is not None:
            size = leader.shape[::-1]
            hidden |= np.asarray(cv2.resize(self.moving, size, interpolation=cv2.INTER_NEAREST))
        return hidden

    def _image(self, shape: tuple[int, int], *, measure: bool = False) -> WorkingImage:
        """Return the newest frame at a size, in whose light it is that of the first."""
        image, stamp_ns = self._frame
        light = self._light if self._options.light else None
        contrast = self._contrast if self._options.contrast else None
        texture = self._options.texture
        return WorkingImage.of(
            image, stamp_ns, shape, light, contrast, texture=texture, measure=measure
        )


def _hidden_after(
    motion: WorldMotion, hidden: NDArray[np.uint8], windows: Sequence[Window]
) -> NDArray[np.uint8]:
    """Return what a frame does not show of windows as the world has moved since, (h, w) uint8."""
    moved, free = np.ones_like(hidden), cv2.inRange(hidden, 0, 0)
    for window in windows:
        moved[window] = cv2.inRange(motion.warped(free, window, cv2.BORDER_CONSTANT), 0, 254)
    return moved


def moving_pixels(
    gray: NDArray[np.uint8], then: NDArray[np.uint8], spread: float
) -> NDArray[np.uint8]:
    """
    Return where something moves against the still world, (h, w) uint8, 1 where it does.

    :param gray, then: (h, w) uint8, of this frame, and before, warped with the still world.
    :param spread: of a still pixel about its mean, in grey levels.
    """
    if then.size == 0:
        return np.zeros(then.shape, np.uint8)
    change = cv2.blur(cv2.absdiff(gray, then), (_CHANGED_PX, _CHANGED_PX))
    level = math.floor(_MOTION_LEVELS + _MOTION_SPREADS * spread)
    _, moving = cv2.threshold(change, level, 1, cv2.THRESH_BINARY)
    return np.asarray(cv2.dilate(moving, np.ones((_CHANGED_PX, _CHANGED_PX), np.uint8)))


def windows_about(
    areas: Iterable[Box], motion: WorldMotion, shape: tuple[int, int]
) -> list[Window]:
    """
    Return disjoint windows with room about people, all of an image of (h, w) if there are none.

    :param areas: where people were in the last frame, in pixels.
    :param motion: of the world since.
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

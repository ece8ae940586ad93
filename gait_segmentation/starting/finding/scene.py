# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
What moves against the world, without an empty scene to begin with.

Images are laid onto a canvas that follows the camera by whole pixels, so that the background is
never interpolated.  A walker stands out as soon as he has moved on by his own width, also if he
was there in the first frame.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.ego_motion.estimator import MotionEstimator
from gait_segmentation.ego_motion.pyramid import Pyramid
from gait_segmentation.geometry import Box, compose, invert, pixel_affine, scaling
from gait_segmentation.images import Window
from gait_segmentation.starting.finding.background import MotionBackground
from gait_segmentation.starting.finding.blobs import Blob, find_blobs
from gait_segmentation.starting.finding.difference import RecentFrames
from gait_segmentation.starting.finding.hollow import fill_hollow
from gait_segmentation.warping import warp_window

__all__ = ['MotionScene', 'SceneFrame']

_SLACK_PX = 1.0
"""Residual rotation and zoom at the corners above which the canvas is laid anew."""

_BROKEN = 0.5
"""Share of pixels that differ at which the world is not the one learnt."""

_LEAST_PROBES = 100
"""Pixels of the background that must be seen to measure the camera's motion by them."""

_LEAST_TEXTURE = 0.25
"""Least product of the background's mean squared gradients that tells a shift."""

_STILL_PX = 0.1

_IDENTITY = scaling(1.0)


@dataclass(frozen=True)
class SceneFrame:
    """
    What moves in one frame, on the canvas.

    ``likelihood`` is (h, w) uint8, 255 = surely no background.  ``blobs`` are what hangs
    together, ``owners`` (h, w) uint8 the number of the blob of each pixel, 0 for none.
    ``shift`` is by how many whole pixels the canvas moved since the last frame: a point of the
    still world at (x, y) is now at (x + dx, y + dy).  ``to_image`` is the 2 x 3 transform of
    positions from the canvas to the small image, ``step`` that from the last small image to this
    one, None for the identity.  ``hidden`` is (h, w) uint8, non-zero where the background cannot
    be seen.  ``fresh`` says that what was known before no longer holds.  ``period`` is the time
    between two frames in seconds, 0 if it is not known.
    """

    likelihood: NDArray[np.uint8]
    blobs: list[Blob]
    owners: NDArray[np.uint8]
    shift: tuple[int, int]
    to_image: NDArray[np.float64]
    step: NDArray[np.float64] | None
    hidden: NDArray[np.uint8]
    fresh: bool
    period: float = 0.0

    def of(self, blobs: Sequence[int]) -> NDArray[np.uint8]:
        """Return where some blobs are, (h, w) uint8 0/255, by their numbers."""
        table = np.zeros(256, np.uint8)
        table[list(blobs)] = 255
        return np.asarray(cv2.LUT(self.owners, table))

    def in_image(self, mask: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return a mask of the canvas as it lies in the small image."""
        every = (slice(0, mask.shape[0]), slice(0, mask.shape[1]))
        return warp_window(mask, self.to_image, every, cv2.BORDER_CONSTANT)

    def box_in_image(self, box: Box) -> Box:
        """Return a box of the canvas as it lies in the small image."""
        x, y = self.to_image[:, :2] @ (box.center_x, box.center_y) + self.to_image[:, 2]
        return Box.from_center(float(x), float(y), box.width, box.height)


class MotionScene:
    """Learns the still world behind a camera that may move, and shows what moves before it."""

    def __init__(self, shape: tuple[int, int]) -> None:
        """Make a scene of which nothing is known, for images of the given (h, w)."""
        self._shape = shape
        self._estimator = MotionEstimator()
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._estimator.reset()
        self._forget()

    def _forget(self) -> None:
        self._background = MotionBackground(self._shape)
        self._recent = RecentFrames()
        self._to_image: NDArray[np.float64] = _IDENTITY
        self._keep = np.zeros(self._shape, np.uint8)

    def update(
        self, colours: NDArray[np.uint8], seconds: float, taken: Sequence[Box] = ()
    ) -> SceneFrame:
        """
        Take in a frame.

        :param colours: (h, w, 3) uint8 of the scene's size, lightness first, then two of chroma.
        :param seconds: its time, later than the last frame's.
        :param taken: boxes in the image in which nobody is looked for, because it is known who
            is there.
        """
        gray = np.ascontiguousarray(colours[:, :, 0])
        camera = self._estimator.update(Pyramid(gray), self._keep).camera
        total = self._register(gray, camera)
        moved = total is not self._to_image
        step = compose(total, invert(self._to_image)) if moved else None
        shift = self._follow(total)
        canvas = cv2.blur(self._laid(colours), (3, 3))
        gray = np.ascontiguousarray(canvas[:, :, 0])
        moving = self._recent.update(gray, seconds, self._background.level)
        period = self._recent.period
        likelihood = self._background.compare(canvas, moving)
        windows = [self._on_canvas(box) for box in taken]
        for window in windows:
            likelihood[window] = moving[window] = 0
        _, evidence = cv2.threshold(likelihood, 127, 255, cv2.THRESH_BINARY)
        evidence = cv2.bitwise_or(evidence, moving)
        fresh = cv2.countNonZero(evidence) > _BROKEN * evidence.size
        if fresh:
            self._forget()
            evidence[:] = 0
            likelihood[:] = 0
        blobs, filled, owners = find_blobs(evidence, moving)
        fill_hollow(likelihood, moving, owners, blobs)
        for window in windows:
            filled[window] = 255
        self._background.learn(canvas, evidence, filled, period)
        self._keep = filled
        hidden = cv2.bitwise_or(filled, evidence)
        return SceneFrame(
            likelihood,
            blobs,
            owners,
            shift,
            self._to_image,
            step,
            hidden,
            fresh,
            period,
        )

    def _register(
        self, gray: NDArray[np.uint8], camera: NDArray[np.float64] | None
    ) -> NDArray[np.float64]:
        """
        Return where the canvas lies in this frame, as a transform of positions to the image.

        The camera moved as measured or not at all, whichever explains the background better; a
        step of Gauss and Newton towards it keeps errors from adding up.
        """
        smooth = cv2.blur(gray, (3, 3))
        motion = self._to_image
        best = self._background.mismatch(smooth, self._keep, motion)
        if camera is not None:
            total = compose(camera, motion)
            found = self._background.mismatch(smooth, self._keep, total)
            if found[0] < best[0]:
                best, motion = found, total
        _, count, xx, xy, yy, x, y = best
        if count < _LEAST_PROBES:
            return self._to_image if camera is None else compose(camera, self._to_image)
        determinant = xx * yy - xy * xy
        if determinant > _LEAST_TEXTURE * (count * count):
            dx = min(max((yy * x - xy * y) / determinant, -1.0), 1.0)
            dy = min(max((xx * y - xy * x) / determinant, -1.0), 1.0)
            if math.hypot(dx, dy) > _STILL_PX:
                motion = compose(np.array([[1.0, 0.0, dx], [0.0, 1.0, dy]]), motion)
        return motion

    def _follow(self, total: NDArray[np.float64]) -> tuple[int, int]:
        """Move the canvas with the camera by whole pixels."""
        if total is self._to_image:
            return 0, 0
        height, width = self._shape
        corners = np.array([[0.0, width, 0.0, width], [0.0, 0.0, height, height]])
        moved = total[:, :2] @ corners + total[:, 2:] - corners
        middle = moved.mean(axis=1)
        if float(np.abs(moved - middle[:, None]).max()) > _SLACK_PX:
            self._background.warp(total)
            self._recent.warp(total)
            self._to_image = _IDENTITY
            return round(float(middle[0])), round(float(middle[1]))
        dx, dy = round(float(middle[0])), round(float(middle[1]))
        self._to_image = total.copy()
        if dx or dy:
            # The canvas then lies by (dx, dy) further to the right and down in the world.
            self._background.shift(dx, dy)
            self._recent.shift(dx, dy)
            self._to_image = compose(total, np.array([[1.0, 0, -dx], [0, 1.0, -dy]]))
        return dx, dy

    def _on_canvas(self, box: Box) -> Window:
        """Return the rows and columns of the canvas that a box of the image lies on."""
        if self._to_image is not _IDENTITY:
            dx, dy = invert(self._to_image)[:, :2] @ (box.center_x, box.center_y)
            off = invert(self._to_image)[:, 2]
            box = box.shifted(dx + off[0] - box.center_x, dy + off[1] - box.center_y)
        return box.slices(self._shape[1], self._shape[0])

    def _laid(self, colours: NDArray[np.uint8]) -> NDArray[np.uint8]:
        if self._to_image is _IDENTITY:
            return colours
        return np.asarray(
            cv2.warpAffine(
                colours,
                pixel_affine(invert(self._to_image)),
                self._shape[::-1],
                flags=cv2.INTER_LINEAR,
                borderMode=cv2.BORDER_REPLICATE,
            )
        )

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Finding people who walk, without a box: moving blobs that match the sequences of a bank."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.geometry import Box
from gait_segmentation.images import check_image, check_stamp
from gait_segmentation.scene.working import working_shape
from gait_segmentation.starting.config import StartingConfig
from gait_segmentation.starting.finding.candidates import Candidate, follow
from gait_segmentation.starting.finding.scene import MotionScene, SceneFrame
from gait_segmentation.starting.finding.watch import light_bank
from gait_segmentation.starting.finding.watching import LEAST_SIGHTINGS, TALL, Watching

__all__ = ['WalkerFinder']

_FINEST, _LARGEST = 0.375, 480
"""Scale and longest side in pixels up to which more is searched for several people."""

_PAUSE_S = 0.5
"""A pause in which too much may have changed."""

_LEAST_PERIOD_S = 0.025
"""Frames that come faster are left out."""


class WalkerFinder:
    """Looks for people who walk, at a small size, and returns their boxes once they are sure."""

    def __init__(
        self, bank: TemplateBank, config: StartingConfig | None = None, people: int = 1
    ) -> None:
        """
        Make a finder that knows nothing of the scene.

        :param bank: the templates; of several builds only the first is searched.
        :param people: how many are looked for at most.
        """
        self.config = config or StartingConfig()
        self._people = people
        self._bank = light_bank(bank)
        self.reset()

    def reset(self) -> None:
        """Forget the scene and everybody in it."""
        self._scene: MotionScene | None = None
        self._frame: SceneFrame | None = None
        self._size: tuple[int, int] | None = None
        self._stamp_ns = 0
        self._candidates: list[Candidate] = []
        self._watching = Watching(self._bank, self.config, self._people)
        self._origin = (0.0, 0.0)
        self._next = 1
        self._known: list[float] = []

    def update(
        self,
        image: NDArray[np.uint8],
        stamp_ns: int,
        occupied: Sequence[Box] = (),
        *,
        wanted: bool = True,
    ) -> list[Box]:
        """
        Take in a frame.

        A stamp that goes back, a pause or another size of the image begins anew.

        :param image: (H, W, 3) uint8 BGR.
        :param stamp_ns: its stamp in nanoseconds.
        :param occupied: boxes of people known already, in source pixels.
        :param wanted: whether anybody is to be found; if not, what moves is followed only.
        :returns: tight boxes of the people newly found, in source pixels.
        :raises InputError: if the image is no BGR image or the stamp is not positive.
        """
        check_image(image)
        check_stamp(stamp_ns)
        size = (image.shape[0], image.shape[1])
        pause = (stamp_ns - self._stamp_ns) / 1e9
        if self._scene is not None and 0 <= pause < _LEAST_PERIOD_S and size == self._size:
            return []
        scale = self._scale(size)
        if self._scene is None or size != self._size or not 0 < pause < _PAUSE_S:
            self.reset()
            self._scene, self._size = MotionScene(size, working_shape(*size, scale)), size
        self._stamp_ns = stamp_ns
        seconds = stamp_ns / 1e9
        taken = [box.scaled(scale) for box in occupied]
        self._known = [box.height for box in taken]
        frame = self._frame = self._scene.update(image, stamp_ns, taken)
        wanted = wanted and self.config.auto_init != 'none'
        self._follow(frame, seconds)
        if not wanted:
            self._watching.forget()
            return []
        found = self._watching.look(frame, self._candidates, taken, stamp_ns)
        return [box.scaled(1 / scale) for box in found]

    def _scale(self, size: tuple[int, int]) -> float:
        """Return the scale of the image that is searched: finer if there may be a crowd."""
        searched = float(self.config.search_size)
        if self._people > 1:
            searched = max(searched, min(_FINEST * max(size), _LARGEST))
        return min(1.0, searched / max(size))

    def judged(self) -> list[tuple[Box, dict[str, float]]]:
        """Return tight boxes and measures of who was matched in the newest frame."""
        assert self._size is not None
        scale = self._scale(self._size)
        return [(box.scaled(1 / scale), measures) for box, measures in self._watching.judged]

    def past(self, stamp_ns: int) -> MotionScene | None:
        """
        Return what the place looked like before there was anybody, None if it is not known.

        :param stamp_ns: the stamp of the newest frame.
        """
        scene = self._scene
        known = scene is not None and scene.is_known and stamp_ns == self._stamp_ns
        return scene if known else None

    def strangers(self, stamp_ns: int) -> NDArray[np.uint8] | None:
        """
        Return where people may be who are not known yet.

        :param stamp_ns: the stamp of the newest frame.
        :returns: (h, w) uint8 of the small image, 255 on what moves for some time, is tall, and
            lies outside of the boxes of people known; None if there is nothing.
        """
        frame = self._frame
        if frame is None or stamp_ns != self._stamp_ns:
            return None
        tall = TALL * max(self._known, default=0.0)
        blobs = [
            each.blob
            for each in self._candidates
            if each.seen == stamp_ns / 1e9
            and each.sightings >= LEAST_SIGHTINGS
            and each.box.height >= tall
        ]
        if not blobs:
            return None
        found = frame.of(blobs)
        found[frame.likelihood < 128] = 0
        return found

    def _follow(self, frame: SceneFrame, seconds: float) -> None:
        dx, dy = frame.shift
        self._origin = self._origin[0] - dx, self._origin[1] - dy
        for each in self._candidates:
            each.box = each.box.shifted(dx, dy)
        self._watching.shift(dx, dy)
        if frame.fresh:
            self._candidates = []
        self._candidates = follow(
            self._candidates,
            frame.blobs,
            seconds,
            self._origin,
            self.config.least_height,
            self._next,
        )
        numbers = {each.number for each in self._candidates}
        self._next = max(numbers | {self._next - 1}) + 1
        self._watching.keep(self._candidates, seconds)

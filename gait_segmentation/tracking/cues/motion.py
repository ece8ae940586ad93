# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Motion: what moves with the body, what stays with the world, and what does neither.

An earlier frame is warped to this one twice, with the world and with the body, and both are
compared with it.  Two things are made of the two differences.  A pixel belongs to the motion that
explains it better, which needs no learning.  And how often each pair of differences was seen on
the person and beside it, apart for what the person had covered in the earlier frame and what not,
is counted from the masks: an arm that swings moves otherwise than the body, leaves do so beside
it, and a wall that the first mask took for a coat does not move at all.
"""

from __future__ import annotations

import math
from collections import deque

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.kernels import kernel
from gait_segmentation.scene.ego_motion import WorldMotion
from gait_segmentation.scene.scene import MOTION_GAP, moving_pixels
from gait_segmentation.tracking.cues import Cue, CueInput, Evidence

_LEAST_MOTION = 0.02
"""Motion of the body against the world from which the better explanation counts, in heights."""

_SIGMA = 12.0
"""Spread of the difference of a pixel that is explained, in grey levels."""

_MOST_EITHER = 2.0
"""Largest log-likelihood ratio of either part, before it is weighed."""

_EDGES = (2, 4, 7, 12, 20)
"""Differences, in grey levels, above which the next grade begins; about a factor apart."""

_GRADES = len(_EDGES) + 1
_PAIRS = _GRADES**2
_GRADE_OF = np.searchsorted(_EDGES, np.arange(256)).astype(np.uint8)

_COUNT_RATE = 0.1
"""Least share by which the counts move towards those of a frame."""

_FEW = 0.02
"""Share of the pixels of either kind from which their own differences count, not those of all."""

_LEAST_PAIR = 0.01
"""Share of the pixels of either kind that may show any pair of differences."""


class MotionCue(Cue):
    """What the motion of the pixels says of one person."""

    def __init__(self) -> None:
        self._shares = np.zeros((2, 2 * _PAIRS))
        """Of person and surroundings, the share of pixels of each pair of differences."""

        self._masks = 0
        self.moving: float | None = None
        """Share of what is expected to be the person that moves against the world, if known."""

        self._latest: deque[float] = deque(maxlen=MOTION_GAP + 1)

    @property
    def lasting(self) -> float:
        """Return the share that moves for longer than a step of the light would look like it."""
        return min(self._latest, default=0.0)

    def evidence(self, given: CueInput) -> Evidence | None:
        """Return what motion says; see :meth:`Cue.evidence`."""
        view, window, pose = given.view, given.window, given.pose
        recent = list(given.states)[-1 - MOTION_GAP :]
        state = next(each for each in recent if each.frame in view.frames)
        earlier = state.frame
        self.moving = None
        usable = earlier is not view.now and not earlier.blank
        if not (usable and given.config.use_motion_cue):
            return None
        motion, (dx, dy) = view.motion_since(earlier), given.moved(state)
        gray = view.now.image.gray[window]
        stays = motion.warped(earlier.image.gray, window)
        person = given.expected > 127
        if person.any():
            moving = moving_pixels(gray, stays, view.background.sigma)
            # A frame that was repeated says nothing of motion.
            if moving.any() or not np.array_equal(view.now.image.gray, earlier.image.gray):
                self.moving = float(moving[person].mean())
                self._latest.append(self.moving)
        if not given.seen:
            return None
        body = WorldMotion(np.array([[1, 0, dx], [0, 1, dy], [0, 0, 1]]))
        moves = body.warped(earlier.image.gray, window)
        stay, move = (cv2.blur(cv2.absdiff(gray, each), (3, 3)) for each in (stays, moves))
        covered = np.zeros_like(stay)
        if (people := view.people_in(earlier)) is not None:
            covered = motion.warped(people, window, cv2.BORDER_CONSTANT)
        x, y = motion.carry(pose.center_x - dx, pose.center_y - dy)
        apart = math.hypot(pose.center_x - x, pose.center_y - y)
        kinds, evidence = np.empty_like(stay), np.empty(stay.shape, np.float32)
        _weigh(
            stay,
            move,
            covered,
            self._ratios(),
            apart >= _LEAST_MOTION * pose.height,
            given.config.motion_weight,
            kinds,
            evidence,
        )
        return Evidence(evidence, kinds)

    def calibrate(self, values: NDArray[np.uint8], person: NDArray[np.uint8]) -> None:
        """Count pairs of differences on and beside the person, see :meth:`Cue.calibrate`."""
        beside = (cv2.dilate(person, np.ones((3, 3), np.uint8)) == 0).view(np.uint8)
        counts = np.stack(
            [
                cv2.calcHist([values], [0], at, [2 * _PAIRS], [0, 2 * _PAIRS])
                .ravel()
                .astype(float)
                for at in (person, beside)
            ]
        )
        if not counts.any(axis=1).all():
            return
        self._masks += 1
        rate = max(_COUNT_RATE, 1 / self._masks)
        self._shares += rate * (counts / counts.sum(axis=1, keepdims=True) - self._shares)

    def _ratios(self) -> NDArray[np.float32]:
        """Return the log-likelihood ratio of each pair of differences, float32."""
        if not self._masks:
            return np.zeros(2 * _PAIRS, np.float32)
        shares = self._shares.reshape(2, 2, _PAIRS)
        # Among what was covered and what was not: where the person was is no evidence.  Of what
        # is seldom seen, as nothing that was covered is beside a person who stands, as of all.
        every = shares.sum(axis=1, keepdims=True)
        shares = shares + _FEW * every
        shares = shares / shares.sum(axis=2, keepdims=True) + _LEAST_PAIR
        ratios = np.log(shares[0] / shares[1])
        return np.clip(ratios, -_MOST_EITHER, _MOST_EITHER).astype(np.float32).ravel()


@kernel('u1[:,::1], u1[:,::1], u1[:,::1], f4[::1], b1, f8, u1[:,::1], f4[:,::1]')
def _weigh(
    stay: NDArray[np.uint8],
    move: NDArray[np.uint8],
    covered: NDArray[np.uint8],
    ratios: NDArray[np.float32],
    better: bool,
    weight: float,
    kinds: NDArray[np.uint8],
    evidence: NDArray[np.float32],
) -> None:
    """
    Fill in which pair of differences the pixels of a window show, and what it says of them.

    :param stay, move: differences from the earlier frame warped with the world and the body.
    :param covered: above 127 where the person was in that.
    :param ratios: of the pairs, see :meth:`MotionCue._ratios`.
    :param better: whether the better explanation counts.
    """
    limit, scale = np.float32(_MOST_EITHER), np.float32(2 * _SIGMA**2)
    for row in range(stay.shape[0]):
        for col in range(stay.shape[1]):
            kind = _GRADES * _GRADE_OF[stay[row, col]] + _GRADE_OF[move[row, col]]
            kind += _PAIRS if covered[row, col] > 127 else 0
            value = ratios[kind]
            if better:
                gain = np.float32(np.int32(stay[row, col]) ** 2 - np.int32(move[row, col]) ** 2)
                value += min(max(gain / scale, -limit), limit)
            kinds[row, col], evidence[row, col] = kind, np.float32(weight) * value

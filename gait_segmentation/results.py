# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
What the stages hand to each other.

All are frozen; the arrays in them belong to the receiver and are never written again by the
stage that made them.  ``stamp_ns`` is the stamp of the source image in nanoseconds and identifies
the frame everywhere.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import InputError
from gait_segmentation.geometry import BodyFrame, Box, Placement, check_body

EMPTY, TRACKED, LOST = 'empty', 'tracked', 'lost'
"""States of a slot."""


@dataclass(frozen=True)
class FeatureWeight:
    """
    How much a feature of adaptive mean shift tells, and how much it is listened to.

    ``variance_ratio`` is that of person against surroundings: 0.5 says nothing.  ``weight`` is
    its share of the likelihood, 0 if it is not used.
    """

    name: str
    variance_ratio: float
    weight: float


@dataclass(frozen=True)
class TrackResult:
    """
    One slot in one frame, as the tracker sees it.

    ``state`` is ``'empty'``, ``'tracked'``, or ``'lost'`` when the person is hidden or gone and
    waited for; if not given, it is empty or tracked by the track id.  ``track_id`` is never used
    twice; 0 means the slot is empty.  ``box`` is the tight box of the person in source pixels,
    None when no person is visible.  ``likelihood`` is the foreground likelihood image, uint8 of
    the working size, 255 = surely person (black when none is).  ``confidence`` in 0..1 says
    how well the person stands out from the surroundings, of which what is hidden takes its share.

    ``body`` is the box of the whole body, also of what is hidden or outside of the image: what
    the matcher starts from; if not given, it is the box.  ``angle`` is its tilt in radians,
    positive when the head leans to the right; it is turned by it about its centre.  ``features``
    are all of the pool, best first, if the likelihood is made of features.  ``reason`` says in
    words why somebody is lost, or why the last track of an empty slot ended.
    """

    stamp_ns: int
    track_id: int
    box: Box | None
    likelihood: NDArray[np.uint8]
    confidence: float
    angle: float = 0.0
    state: str = ''
    body: Box | None = None
    features: tuple[FeatureWeight, ...] = ()
    reason: str = ''

    def __post_init__(self) -> None:
        if not self.state:
            object.__setattr__(self, 'state', TRACKED if self.track_id else EMPTY)
        if self.body is None:
            object.__setattr__(self, 'body', self.box)


@dataclass(frozen=True)
class MatchResult:
    """
    The state of the best path at the emitted frame.

    ``stamp_ns`` is the emitted frame, which lies ``lag`` frames before the newest one.
    ``body`` is where the template stands, in source pixels, None when no person is tracked (then
    the numbers are 0 and ``shape_prior`` is black).  ``placement`` is the same relative to the
    tracked box.  ``sequence`` and ``phase_index`` name the template in the bank.
    ``phase`` is the gait phase in [0, 1), 0 = heel contact of the leg nearer to the camera (seen
    from front or back: of the leg it was counted from before), and ``phase_rate`` its rate in
    strides per second; both come from a clock, so that ``phase`` need not be that of the
    template.  ``azimuth`` is the walking direction in radians: 0 to the right in the image, pi/2
    away from the camera, pi to the left, -pi/2 towards the camera.  ``similarity`` is the Tanimoto
    similarity of the template with the likelihood, ``confidence`` in 0..1 the probability that
    ``phase`` is right to 5 %, half strides apart.  ``shape_prior`` is the template warped into
    the image: uint8, same size as the likelihood, 255 inside, soft edge.  ``placed`` is the
    tracked box as the path moves and scales it.  ``box`` is the refined box: by
    ``matching.use_likely_box`` the tight one about what is likely where the template stands, None
    where nothing is, or, as in the paper, ``placed``.  Both are upright, in source pixels.
    """

    stamp_ns: int
    track_id: int
    body: BodyFrame | None
    placement: Placement | None
    sequence: int
    phase_index: int
    phase: float
    phase_rate: float
    azimuth: float
    similarity: float
    confidence: float
    shape_prior: NDArray[np.uint8]
    placed: Box | None = None
    box: Box | None = None

    @classmethod
    def empty(cls, stamp_ns: int, track_id: int, shape: tuple[int, ...]) -> MatchResult:
        """Return that of a frame without a person; ``shape`` is (h, w) of its likelihood."""
        prior = np.zeros(shape, np.uint8)
        return cls(stamp_ns, track_id, None, None, 0, 0, 0.0, 0.0, 0.0, 0.0, 0.0, prior)


@dataclass(frozen=True)
class SegmentationResult:
    """
    The silhouette of one person in one frame.

    ``mask`` is uint8 0/255 of the source's size.  ``reason`` is empty, or says in words why the
    mask is empty.
    """

    stamp_ns: int
    track_id: int
    mask: NDArray[np.uint8]
    reason: str


@dataclass(frozen=True)
class Feedback:
    """
    What the later stages found for a frame, from which the tracker learns.

    ``mask`` is uint8 0/255 of the source's size, ``shape_prior`` uint8 of the working size and
    ``body`` in source pixels, all of the frame with stamp ``stamp_ns``.
    """

    stamp_ns: int
    track_id: int
    mask: NDArray[np.uint8]
    body: BodyFrame | None
    shape_prior: NDArray[np.uint8]

    def check(self, source: tuple[int, int] | None) -> None:
        """
        Refuse what is not of an image of (H, W).

        :raises InputError: if the mask has another size or type, or the body makes no sense.
        """
        mask = self.mask
        if mask.shape != source or mask.dtype != np.uint8:
            raise InputError(
                f'mask must be uint8 of the source size {source}, got {mask.shape} {mask.dtype}'
            )
        if self.body is not None:
            check_body(self.body, (mask.shape[1], mask.shape[0]))

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One tracked person: predicted into each frame, observed in it, lost and found again."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.detector.detection import Detection, SoftMask
from gait_segmentation.geometry import REACH, Box, body_window
from gait_segmentation.images import Window, size_of
from gait_segmentation.results import LOST, TRACKED, FeatureWeight, Feedback, TrackResult
from gait_segmentation.scene.scene import Frame, Shift, View
from gait_segmentation.starting import FirstMask
from gait_segmentation.tracking.appearance import Appearance
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.existence import Existence
from gait_segmentation.tracking.pixels import (
    ALONE,
    LEAST_SEEN,
    PixelClaim,
    Visibility,
    visible_box,
)
from gait_segmentation.tracking.pose import Pose
from gait_segmentation.tracking.state import History, Silhouette, State

_COAST_S, _STOP_S, _MOST_LOST_S = 1.0, 0.5, 1.0
"""
Time for which a hidden person is taken to walk on, in which they are then to stop, and for which
they are lost longer with a frame at most, however long that took to come.
"""

_OFF, _FASTEST = 0.5, 6.0
"""
How far from where they are expected who is lost may be at first, and how much farther after each
second, in body heights.
"""

_SHOWN_SHARE = 0.5
"""Share of a person from which a map shows them."""

_TALLER, _EXACT = 1.25, 0.7
"""
Height in which a detector sees a person, over that of what is followed, which is then a part, and
the score from which its boxes are exact enough to tell.
"""

_PART_NS = 300_000_000
"""Time for which all looks have to see that: single ones take in a desk, or a passer."""

_ON = 0.5
"""Share of a mask on a person from which it shows no one else."""

WHOLE = 0.75
"""Share of a person from which all of them is seen, and so followed."""


class Track(ABC):
    """
    One tracked person in a view of the scene.

    ``pose`` is that in the newest frame, and ``history`` how they came there.  ``state`` is
    tracked or lost, with the ``reason``, as :func:`.next_state` says, and ``slot`` the number of
    the slot in which they are published, None if they are not.  ``existence`` says whether they
    are a person.  ``seen`` is the share of the person seen last, too little for
    ``unseen_frames``, ``lost_s`` the seconds since a lost person was seen, and ``found`` whether
    they are in the newest frame.
    """

    features: tuple[FeatureWeight, ...] = ()
    """What the likelihood is made of, best first, if it is made of features."""

    def __init__(
        self,
        track_id: int,
        view: View,
        pose: Pose,
        config: TrackingConfig,
        *,
        existence: Existence | None = None,
        slot: int | None = None,
        by_map: bool = False,
        outlined: bool = False,
    ) -> None:
        """
        Begin in the newest frame of a view.

        :param existence: without one their box was given.
        :param by_map: whether a heat map has to go on showing them.
        :param outlined: whether a map or mask shows their outline.
        """
        self.track_id, self.view, self.config, self.pose = track_id, view, config, pose
        self.slot, self._by_map, self._outlined = slot, by_map, outlined
        self.state, self.reason, self.confidence = TRACKED, '', 0.0
        self.existence = existence or Existence(view.now.image.stamp_ns, given=True)
        self.history = History(view.now)
        self.seen, self.unoccluded = 1.0, True
        self.usual_ns = view.now.image.stamp_ns
        """Stamp of the last frame in which they surely looked as usual."""

        self.lost_s, self.unseen_frames, self.found = 0.0, 0, False
        self._box: Box | None = None
        self._part_since_ns = 0
        self._window: tuple[Pose | None, Window] = None, (slice(0), slice(0))

    @property
    def displacement(self) -> Shift:
        """Return how far the body went since the track began, in pixels."""
        return self.history.displacement

    @property
    def box(self) -> Box:
        """Return the box about what can be seen, in source pixels."""
        return self._box if self._box is not None else self.body

    @property
    def body(self) -> Box:
        """Return the box of the whole body in source pixels, in the frame of the body."""
        return self.pose.box.scaled(1 / self.view.scale)

    def boxes_at(self, stamp_ns: int) -> tuple[Box, Box]:
        """Return the boxes of the body and of what can be seen in the frame nearest to a stamp."""
        (x, y), (now_x, now_y) = self.history.place_at(stamp_ns).displacement, self.displacement
        dx, dy = (x - now_x) / self.view.scale, (y - now_y) / self.view.scale
        return self.body.shifted(dx, dy), self.box.shifted(dx, dy)

    @property
    def is_outside(self) -> bool:
        """Return whether nothing of what is about the person is in the image."""
        return not all(size_of(self.window))

    @property
    def window(self) -> Window:
        """Return the rows and columns of the view in which pixels are judged."""
        pose, (height, width) = self.pose, self.view.shape
        if self._window[0] is not pose:
            around = body_window(pose.center_x, pose.center_y, pose.height, pose.box)
            self._window = pose, around.slices(width, height)
        return self._window[1]

    def is_near(self, other: Track) -> bool:
        """Return whether the box about another person comes near to that about this one."""
        gap = REACH * self.pose.height
        return self.pose.area.padded(gap, gap).iou(other.pose.box) > 0

    @abstractmethod
    def expected_mask(self) -> NDArray[np.uint8]:
        """Return where the person is expected, (h, w) uint8 0/255 of the window about them."""

    @abstractmethod
    def claim(self) -> PixelClaim | None:
        """Judge the pixels in the window about the person, None if all of it is outside."""

    def refine(self, values: NDArray[np.uint8], visibility: Visibility, claim: PixelClaim) -> None:
        """
        Take in the likelihood of a person who is seen.

        :param values: (h, w) uint8 likelihood of the window of the claim.
        """
        self.show(values, visibility, claim)

    @abstractmethod
    def looks_alike(self, mask: NDArray[np.uint8]) -> bool:
        """Return whether what a mask, (h, w) uint8, shows in the newest frame may be them."""

    def silhouette(self) -> NDArray[np.uint8] | None:
        """Return what of the body optical flow can follow, (h, w) uint8 of the window, if any."""
        return None

    @property
    def reach(self) -> float:
        """Return how far from where they are expected a lost person can be, in body heights."""
        return _OFF + _FASTEST * self.lost_s

    full: Silhouette | None = None
    """The last of all of a person whom no border cuts, who is looked for by it, if they are."""

    @property
    def is_shown(self) -> bool:
        """Return whether the last heat map showed them."""
        return self.shown >= _SHOWN_SHARE

    shown = 0.0
    """Share of the person that the last heat map showed."""

    def log_ratio(
        self, lab: NDArray[np.uint8], rows: NDArray[np.float32], window: Window
    ) -> NDArray[np.float32]:
        """Return ln p(person) / p(surroundings) by colours; see :func:`.likelihood.log_ratio`."""
        return np.zeros(rows.shape, np.float32)

    def similarity(self, start: FirstMask, frame: Frame) -> float:
        """Return how alike (0..1) the person and a first mask in some frame are."""
        return 0.0

    appearance: Appearance | None = None
    """What they look like, if that is known."""

    def likeness(self, other: Track) -> float:
        """Return how alike (0..1) another track looks to what is known of this one."""
        if self.appearance is None or other.appearance is None:
            return 0.0
        return self.appearance.similarity(other.appearance.last)

    masked_ns = 0
    """Stamp of the frame in which a network has drawn them last, 0 for none."""

    is_part = False
    """Whether for some time all looks of a detector saw more of them than is followed."""

    def see(self, detection: Detection, stamp_ns: int) -> None:
        """Take in where a detector saw the person in the frame of a stamp, and how clearly."""
        share = detection.box.height / max(self.view.source)
        self.existence = self.existence.seen(detection.score, share)
        body = self.boxes_at(stamp_ns)[0].clipped(*self.view.source[::-1])
        taller = body is not None and detection.box.height > _TALLER * body.height
        since_ns = self._part_since_ns or stamp_ns
        self._part_since_ns = since_ns if taller and detection.score >= _EXACT else 0
        self.is_part = self._part_since_ns > 0 and stamp_ns - since_ns >= _PART_NS

    def take_mask(self, mask: SoftMask | None, box: Box) -> None:
        """
        Take in what a network has drawn of the person in the newest frame, None if of another.

        :param box: in which it was asked to, in source pixels.
        """
        self.masked_ns = self.view.now.image.stamp_ns

    def is_on(self, mask: SoftMask) -> bool:
        """Return whether most of what a network has drawn lies where the person is expected."""
        return mask.share_on(self.expected_mask(), self.window, self.view.scale) > _ON

    def drawn_now(self) -> SoftMask | None:
        """Return what a network has drawn of them in the newest frame, None if none did."""
        return None

    def overlook(self) -> None:
        """Take in that a detector did not see the person where they should be."""
        self.existence = self.existence.unseen()

    def resume(self) -> None:
        """Take in that a person is seen where they were expected."""
        self.existence = self.existence.seen_again()

    def succeed(self, lost: Track) -> None:
        """Go on as a track that was lost, which was the same person."""
        self.track_id, self.slot = lost.track_id, lost.slot
        self.existence = lost.existence.seen_again()

    def publish(self, slot: int | None) -> None:
        """Give a slot to somebody who was followed without one, or take it from them: None."""
        self.slot = slot

    def see_map(self) -> None:
        """Take in whether a heat map that has just come shows them, if it has to."""
        if self._by_map and self.view.heat is not None and not self.view.heat.frames:
            (self.resume if self.is_shown else self.overlook)()

    def detected_in(self, stamp_ns: int) -> Box:
        """
        Return where a detector saw them last, as they went from there to the frame of a stamp.

        In source pixels; if it did not of late, the box of what can be seen of them.
        """
        return self.boxes_at(stamp_ns)[1]

    def fade(self, chroma: float) -> None:  # noqa: B027
        """Go on as if all that is known of the colours had the same a* and b*."""

    def correct(
        self, state: State, feedback: Feedback | None, *, alone: bool
    ) -> tuple[Window, Window, NDArray[np.uint8]] | None:
        """
        Learn from the mask of a frame that is kept, if one came.

        :param alone: whether no other track is near.
        :returns: the window about the person, and a window and (h, w) uint8 of where the person
            may be in that frame; None if the mask says nothing.
        """
        return None

    def configure(self, config: TrackingConfig) -> None:
        """Go on with another configuration."""
        self.config = config

    def stop(self) -> None:
        """Take the person to stand until they are seen to move again."""
        self.pose = self.pose.standing()

    def rate(self, visibility: Visibility) -> None:
        """Take in how distinct the person is where they are expected."""
        self.confidence = visibility.confidence

    def shift(self, dx: float, dy: float) -> None:
        """Move the body in the newest frame."""
        self.pose = self.pose.shifted(dx, dy)
        self.history.shift(dx, dy)

    def predict(self, body: NDArray[np.uint8] | None) -> None:
        """
        Predict the place in the view's newest frame.

        :param body: (h, w) uint8 of the window about the person in the frame before, what of the
            body can be followed from there, without what others hid; None if there is nothing.
        """
        pose, view, seconds = self.pose, self.view, self.view.step_s
        x, y = view.now.motion.carry(pose.center_x, pose.center_y)
        world, step = (x - pose.center_x, y - pose.center_y), pose.step(seconds)
        shift = None
        if self.state == LOST:
            # In a gap no one was looked for.
            self.lost_s, self.found = self.lost_s + min(seconds, _MOST_LOST_S), False
            share = math.exp(-max(self.lost_s - _COAST_S, 0.0) / _STOP_S)
            step = share * step[0], share * step[1]
        elif body is not None and (self.seen >= WHOLE or self.unoccluded):
            corner = self.window[0].start, self.window[1].start
            shift = view.points.body_shift(body, view.now.motion, step, corner)
        if shift is None:
            shift = world[0] + step[0], world[1] + step[1]
        else:
            self.pose = pose.with_step(world, shift, seconds)
        self.history.enter(view.now)
        self.shift(*shift)
        # A velocity that was measured wrongly leads anywhere; who is lost waits at the border.
        self.shift(*self.pose.outside_by(view.shape))

    def observe(
        self, likelihood: NDArray[np.uint8], claim: PixelClaim, occluder: NDArray[np.uint8] | None
    ) -> None:
        """
        See how well the person stands out, and refine the place.

        :param likelihood: (h, w) uint8 of the view.
        :param occluder: (h, w) uint8 of the claim's window, non-zero where others hide them.
        """
        values = likelihood[claim.window]
        visibility = Visibility.of(values, claim.mask, occluder)
        self.rate(visibility)
        self.unoccluded = visibility.share > ALONE
        inside = self.pose.share_inside(self.view.shape) >= LEAST_SEEN / 2
        if self._is_seen(visibility.seen, inside=inside):
            self.refine(values, visibility, claim)

    def miss(self) -> None:
        """Take in that nothing can be seen in the newest frame."""
        self.confidence, self.found = 0.0, False
        if self.state == TRACKED:
            self._is_seen(0.0)

    def _is_seen(self, seen: float, *, inside: bool = True) -> bool:
        """Take in which share of the person was seen; return whether that is enough."""
        self.seen = seen
        enough = seen >= LEAST_SEEN and inside
        self.unseen_frames = 0 if enough else self.unseen_frames + 1
        return enough

    def enter(self, state: str, reason: str) -> None:
        """Go over to a state; see :func:`.next_state`."""
        if state != self.state:
            self.lost_s = 0.0
        if state == LOST and self.state != LOST:
            self._box, self.found = None, False
        self.state, self.reason = state, reason
        self.unseen_frames = self.unseen_frames if state == TRACKED else 0

    def find(self, values: NDArray[np.uint8], visibility: Visibility, claim: PixelClaim) -> None:
        """
        Take in that a lost person is seen where the expected mask is.

        :param values: (h, w) uint8 likelihood of the window of the claim.
        """
        self.found, self.seen = True, visibility.seen
        self.show(values, visibility, claim)

    def show(self, values: NDArray[np.uint8], visibility: Visibility, claim: PixelClaim) -> None:
        """Take the likely pixels near the mask for what can be seen of the person."""
        mask, height = visibility.unoccluded, self.pose.height
        box = visible_box(values, mask, claim.away, claim.window, height)
        self._box = None if box is None else box.scaled(1 / self.view.scale)

    def result(self, likelihood: NDArray[np.uint8]) -> TrackResult:
        """
        Return what is known in the newest frame.

        :param likelihood: (h, w) uint8 of the view.
        """
        seen = self.state == TRACKED
        source = self.view.source
        return TrackResult(
            self.view.now.image.stamp_ns,
            self.track_id,
            (self.box.clipped(source[1], source[0]) or self.body) if seen else None,
            likelihood,
            self.confidence,
            self.pose.angle,
            self.state,
            self.body if seen else None,
            self.features if seen else (),
            self.reason,
        )

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Bystanders: people near those in a slot, followed so that each takes their own pixels along.

A heat map or a detector shows a person, never which one.  Whoever it shows apart from everybody
known, and near somebody in a slot, has a track as well, which is not published.  No silhouette is
cut for them: they are learnt from their likelihood, and not while they meet somebody in a slot.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import count

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import BodyFrame, Box
from gait_segmentation.heat_maps import label_regions
from gait_segmentation.images import distance_from, overlap, placed, within
from gait_segmentation.results import LOST, TRACKED, Feedback
from gait_segmentation.scene.scene import View
from gait_segmentation.starting import FirstMask
from gait_segmentation.tracking.association import PixelClaim
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.fusion import FusionTrack
from gait_segmentation.tracking.life_cycle import next_state
from gait_segmentation.tracking.track import SAME_PERSON, Track
from gait_segmentation.tracking.visibility import GUARD

MOST = 4
"""Most bystanders at a time, the tallest first."""

_NEAR, _AWAY = 0.4, 0.8
"""
How far beside somebody in a slot a bystander begins, and from where on they need not be followed,
in body heights.
"""

_SHORTEST, _TALLEST = 0.5, 2.0
"""Height of a bystander over that of who is near."""

_COMMON = 0.1
"""Share of a region, or of a bystander, that may be where somebody else is expected."""

_SHOWN_SHARE, _UNSHOWN_FRAMES = 0.5, 5
"""
Share of a person that a map must show to tell who else is near, and frames in a row without that
after which a bystander was none.
"""

_LOST_S = 1.0
"""Time for which a bystander out of sight is looked for, in seconds."""


class Bystander(FusionTrack):
    """A track that is not published."""

    in_slot = False
    unshown = 0
    """Frames in a row in which the map that vouches for them did not show them."""

    def __init__(
        self, track_id: int, view: View, start: FirstMask, config: TrackingConfig, *, by_map: bool
    ) -> None:
        """Begin with the first mask; either a map or a detector vouches for them."""
        super().__init__(track_id, view, start, config)
        self._by_map = by_map

    def claim(self) -> PixelClaim | None:
        """Judge pixels, which those in a slot are taken to hide: their masks are better."""
        claim = super().claim()
        return claim and replace(claim, hidden=True, vague=not self._by_map)

    def keep(self, likelihood: NDArray[np.uint8], slots: Sequence[Track]) -> None:
        """
        Keep what is likely where they are expected as the mask of the newest frame.

        :param likelihood: (h, w) uint8 of the view.
        :param slots: everybody in a slot; while one of them is met nothing is kept.
        """
        if self._by_map:
            self.unshown = 0 if self.shown >= _SHOWN_SHARE else self.unshown + 1
        if self.state != TRACKED or self.is_outside:
            return
        window, expected = self.window, self.expected_mask()
        for other in slots:
            shared = overlap(other.window, window) if other.view is self.view else None
            if shared is not None:
                theirs = other.expected_mask()[within(shared, other.window)]
                both = cv2.bitwise_and(expected[within(shared, window)], theirs)
                if cv2.countNonZero(both) > _COMMON * cv2.countNonZero(expected):
                    return
        near = distance_from(expected > 127) < GUARD * self.pose.height
        mask = np.where(near & (likelihood[window] > 127), np.uint8(255), np.uint8(0))
        self.states[-1].notes[Bystander.__name__] = window, mask

    def feedback(self, stamp_ns: int) -> Feedback | None:
        """Return what was kept of a frame, in working pixels, None if nothing was."""
        for state in self.states:
            noted = state.notes.get(Bystander.__name__)
            if noted is not None and state.frame.image.stamp_ns == stamp_ns:
                mask = placed(noted[1], noted[0], self.view.shape)
                return Feedback(stamp_ns, self.track_id, mask, None, mask)
        return None

    def is_needed(self, slots: Sequence[Track]) -> bool:
        """Return whether they are there, and near somebody in a slot."""
        if (self.state == LOST and self.lost_s > _LOST_S) or self.unshown >= _UNSHOWN_FRAMES:
            return False
        here = (other for other in slots if other.view is self.view)
        return any(_is_within(self.pose.box, other, _AWAY) for other in here)


class Bystanders:
    """All bystanders, from frame to frame."""

    def __init__(self) -> None:
        """Begin without any."""
        self._ids = count(-1, -1)
        self.clear()

    def clear(self) -> None:
        """Let go of all of them."""
        self.tracks: list[Bystander] = []

    def drop(self, view: View, box: Box) -> None:
        """Let go of who is in a box of a view, in working pixels: they have a slot now."""
        there = self.at(view, box)
        self.tracks = [each for each in self.tracks if each not in there]

    def at(self, view: View, box: Box) -> list[Bystander]:
        """Return who is in a box of a view, in working pixels."""
        here = (each for each in self.tracks if each.view is view)
        return [each for each in here if each.pose.box.iou(box) >= SAME_PERSON]

    @property
    def is_full(self) -> bool:
        """Return whether there are too many for another one."""
        return len(self.tracks) >= MOST

    def begin(self, view: View, start: FirstMask, config: TrackingConfig, *, by_map: bool) -> None:
        """Begin with somebody new, unless there are too many."""
        if not self.is_full:
            number = next(self._ids)
            self.tracks.append(Bystander(number, view, start, config, by_map=by_map))

    def feedback(self, stamp_ns: int) -> dict[int, Feedback]:
        """Return what is learnt of a frame, by track id."""
        found = (each.feedback(stamp_ns) for each in self.tracks)
        return {each.track_id: each for each in found if each is not None}

    def update(
        self,
        views: Sequence[View],
        slots: Sequence[Track],
        likelihoods: Mapping[int, NDArray[np.uint8]],
        config: TrackingConfig,
    ) -> None:
        """
        Go on with those who are still near somebody, and begin with new ones.

        :param slots: everybody in a slot.
        :param likelihoods: of the newest frame, (h, w) uint8, by track id.
        """
        for each in self.tracks:
            state, reason = next_state(each, each.view.now.image.stamp_ns)
            each.enter(TRACKED if state == TRACKED else LOST, reason)
            if each.track_id in likelihoods:
                each.keep(likelihoods[each.track_id], slots)
        self.tracks = [each for each in self.tracks if each.is_needed(slots)]
        if not config.use_bystanders or any(track.state == LOST for track in slots):
            # The map may show them: whoever is found first would not be looked at again.
            return
        for view in views:
            known = [track for track in (*slots, *self.tracks) if track.view is view]
            for start in newcomers(view, known):
                self.begin(view, start, config, by_map=True)


def newcomers(view: View, known: Sequence[Track]) -> list[FirstMask]:
    """
    Return the first masks of bystanders whom the map of the newest frame shows, the tallest first.

    :param known: everybody who is followed in the view.
    """
    frame = view.now
    if frame.heat is None or frame.heat_trust < 1 or frame.heat_frames or frame.blank:
        return []
    taken = np.zeros(view.shape, np.uint8)
    for track in known:
        taken[track.window] |= track.expected_mask()
    labels, stats = label_regions(frame.heat)
    common = np.bincount(labels[taken > 0], minlength=len(stats))
    found = []
    for number, (x, y, width, height, area) in enumerate(stats[1:].tolist(), 1):
        box = Box(x, y, width, height)
        if common[number] <= _COMMON * area and _is_beside(box, known):
            there = labels == number
            votes = np.where(there, frame.heat / np.float32(255), np.float32(0))
            mask = np.where(there, np.uint8(255), np.uint8(0))
            body = BodyFrame(box.center_x, box.center_y, box.height)
            found.append(FirstMask(mask, votes, box, body))
    return sorted(found, key=lambda start: -start.box.height)


def _is_beside(box: Box, known: Sequence[Track]) -> bool:
    """Return whether a box is near somebody in a slot, and the map shows all of those."""
    near = [track for track in known if track.in_slot and is_near(box, track)]
    return bool(near) and all(track.shown >= _SHOWN_SHARE for track in near)


def is_near(box: Box, track: Track) -> bool:
    """Return whether a box, in pixels of the track's view, may be of a person beside them."""
    alike = _SHORTEST < box.height / track.pose.height < _TALLEST
    return alike and _is_within(box, track, _NEAR)


def _is_within(box: Box, track: Track, heights: float) -> bool:
    """Return whether a box comes as near to a person as so many of their heights."""
    margin = heights * track.pose.height
    return track.pose.area.padded(margin, margin).iou(box) > 0

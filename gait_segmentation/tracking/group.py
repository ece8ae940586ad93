# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The people of one view: predicted, observed and corrected together, since they may overlap."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import combinations

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import Window, distance_from, overlap, size_of, within
from gait_segmentation.results import LOST, TRACKED, Feedback
from gait_segmentation.scene.scene import View
from gait_segmentation.tracking.appearance import SAME_COLOURS, similarity
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.fusion import grown
from gait_segmentation.tracking.likelihood import likelihood_image
from gait_segmentation.tracking.pixels import GUARD, associate
from gait_segmentation.tracking.reidentification import reacquire
from gait_segmentation.tracking.track import Track

Likelihoods = dict[int, NDArray[np.uint8]]

ExpectedMask = tuple[Track, Window, NDArray[np.uint8]]
"""Where a person is expected: rows and columns about them, and (h, w) uint8 0/255 of these."""

_OWN = 'own'
"""Name of the note of what is likely theirs of who has no slot."""

_COMMON = 0.1
"""Share of somebody from which they meet another one."""

_ONE, _APART, _BEHIND_S = 0.4, 0.3, 0.5
"""
Share of one of two people from which pixels hardly tell which of them is which, how fast they then
go past each other, in body heights a second, and for how long one of them is behind the other.
"""


def visible_silhouettes(tracks: Sequence[Track]) -> dict[int, NDArray[np.uint8]]:
    """
    Return what of each person can be followed into the next frame, without what others hide.

    Of those who pass each other there is nothing: how they went tells more.

    :param tracks: all people of a view.
    :returns: by track id (h, w) uint8 of the window about the person.
    """
    seen = [track for track in tracks if track.state == TRACKED]
    masks = [(track, track.window, track.expected_mask()) for track in seen]
    visible, passing = {}, _passing(tracks)
    for track, window, _ in masks:
        silhouette = track.silhouette()
        if silhouette is not None and track.track_id not in passing:
            hidden = _occluder(track, masks, window)
            if hidden is not None:
                silhouette = np.asarray(cv2.bitwise_and(silhouette, cv2.bitwise_not(hidden)))
            visible[track.track_id] = silhouette
    return visible


def observe(view: View, tracks: Sequence[Track]) -> Likelihoods:
    """
    Associate pixels with people, observe each by what it got, and look for the lost.

    :param tracks: all people of the view.
    :returns: the likelihoods, (h, w) uint8, by track id.
    """
    likelihoods: Likelihoods = {}
    if view.now.blank:
        for track in tracks:
            track.miss()
        return likelihoods
    _measure_misplacement(view, tracks)
    judged = [(track, track.claim()) for track in tracks]
    present = [(track, claim) for track, claim in judged if claim is not None]
    logits = [claim.logit for _, claim in present]
    if all(track.config.use_association for track in tracks):
        logits = associate([claim for _, claim in present])
    masks: list[ExpectedMask] = []
    for (track, claim), logit in zip(present, logits, strict=True):
        likelihoods[track.track_id] = likelihood_image(logit, claim.window, view.shape)
        masks.append((track, claim.window, claim.mask))
    for track, claim in present:
        if track.state == TRACKED:
            occluder = _occluder(track, masks, claim.window)
            track.observe(likelihoods[track.track_id], claim, occluder)
    lost = [each for each in tracks if each.state == LOST and each.lost_s > 0]
    if lost:
        taken = np.zeros(view.shape, np.uint8)
        for track in tracks:
            if track.state == TRACKED:
                _take(taken, track, likelihoods[track.track_id])
        claims = {track.track_id: claim for track, claim in present}
        for track in lost:
            number = track.track_id
            found = reacquire(track, claims.get(number), likelihoods.get(number), taken)
            if found is not None:
                likelihoods[number] = found
                _take(taken, track, found)
    return likelihoods


def correct(
    view: View,
    tracks: Sequence[Track],
    stamp_ns: int,
    by_track: Mapping[int, Feedback],
    config: TrackingConfig,
) -> None:
    """
    Learn a frame: people first, then what surrounds all of them.

    :param tracks: all people of the view.
    :param by_track: the masks of that frame by track id.
    """
    frame = view.take(stamp_ns)
    if frame is None:
        return
    people = np.zeros(view.shape, np.uint8)
    around: list[Window] = []
    passing = _passing(tracks)
    for track in tracks:
        state, learnt = track.history.state_in(frame), None
        if state is not None:
            alone = not any(track.is_near(other) for other in tracks if other is not track)
            # The masks of two who pass each other may be of either.
            clear = None if track.track_id in passing else by_track.get(track.track_id)
            learnt = track.correct(state, clear, alone=alone)
        # Who has begun since may have been there already.
        if learnt is None:
            people[track.pose.area.slices(view.shape[1], view.shape[0])] = 255
        else:
            window, where, mask = learnt
            people[where] |= mask
            around.append(window)
    if around and config.use_background:
        view.add_background(frame, people, around, gate=config.use_motion_gate)


def _measure_misplacement(view: View, tracks: Sequence[Track]) -> None:
    """See how far the background is off in the newest frame, beside where people are expected."""
    people = np.zeros(view.shape, np.uint8)
    seen = [track for track in tracks if track.state == TRACKED]
    for track in seen:
        people[track.window] |= track.expected_mask()
    if people.any():
        where, margin = grown(people, max(track.pose.height for track in seen))
        people[where] = margin
        view.background.notice_jolt(view.now.image.lab, people, [track.window for track in seen])


def _occluder(
    track: Track, masks: Sequence[ExpectedMask], window: Window
) -> NDArray[np.uint8] | None:
    """Return where in a window those who stand nearer hide a person, None if nowhere."""
    occluder = None
    for other, about, mask in masks:
        nearer = other is not track and other.state != LOST and other.pose.feet > track.pose.feet
        if nearer and (shared := overlap(about, window)) is not None:
            if occluder is None:
                occluder = np.zeros(size_of(window), np.uint8)
            occluder[within(shared, window)] |= mask[within(shared, about)]
    return occluder


def _take(taken: NDArray[np.uint8], track: Track, likelihood: NDArray[np.uint8]) -> None:
    """Mark the likely pixels where a person is expected, in images of the working size."""
    likely = likelihood[track.window] > 127
    taken[track.window] |= np.where(likely, track.expected_mask(), 0)


def keep_own(track: Track, likelihood: NDArray[np.uint8], others: Sequence[Track]) -> None:
    """
    Keep what is likely theirs as the mask of the newest frame, if nobody is met.

    Of who has no slot no mask is cut: they learn from that.

    :param likelihood: (h, w) uint8 of the view.
    :param others: in the view, of whom masks are cut.
    """
    if track.state == LOST or track.is_outside or any(_meet(track, each) for each in others):
        return
    near = distance_from(track.expected_mask() > 127) < GUARD * track.pose.height
    likely = likelihood[track.window] > 127
    mask = np.where(near & likely, np.uint8(255), np.uint8(0))
    track.history.note(_OWN, track.window, mask)


def own_feedback(track: Track, stamp_ns: int) -> Feedback | None:
    """Return what was kept of a frame without a mask, in working pixels, if anything was."""
    for state in track.history.states:
        if state.frame.image.stamp_ns == stamp_ns and (mask := state.noted(_OWN)) is not None:
            return Feedback(stamp_ns, track.track_id, mask, None, mask)
    return None


def _passing(tracks: Sequence[Track]) -> set[int]:
    """Return the ids of people who look alike and go past each other, so close as to be one."""
    near = [each for each in tracks if not each.is_outside and each.lost_s < _BEHIND_S]
    pairs = (pair for pair in combinations(near, 2) if _pass(*pair))
    return {track.track_id for pair in pairs for track in pair}


def _pass(one: Track, other: Track) -> bool:
    """Return whether two people look alike, and go past each other so close as to be one."""
    against = math.dist(one.pose.velocity, other.pose.velocity)
    if against < _APART * one.pose.height or not one.pose.box.iou(other.pose.box):
        return False
    looks = [each.appearance.last for each in (one, other) if each.appearance is not None]
    alike = len(looks) == 2 and similarity(*looks) >= SAME_COLOURS
    return alike and max(_common_share(one, other), _common_share(other, one)) > _ONE


def _common_share(track: Track, other: Track) -> float:
    """Return the share of where somebody is expected in which another one is, too."""
    window, expected = track.window, track.expected_mask()
    shared = overlap(other.window, window)
    if shared is None:
        return 0.0
    theirs = other.expected_mask()[within(shared, other.window)]
    both = cv2.bitwise_and(expected[within(shared, window)], theirs)
    return cv2.countNonZero(both) / max(cv2.countNonZero(expected), 1)


def _meet(track: Track, other: Track) -> bool:
    """Return whether somebody is expected where another one is."""
    return _common_share(track, other) > _COMMON

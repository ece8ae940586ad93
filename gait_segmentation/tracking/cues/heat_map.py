# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The cue from a heat map: P(person) as others see it, such as a network.

A map that is right is believed whatever the masks say, and one that has nothing to do with the
frame never: how far it counts is how its outline lies on edges of the image, see
:class:`.MapTrust`.  But it says where *a* person is, not which one, and may miss the person or a
part of them: what it shows apart from where the person is expected is of others, a region too
large for one person is of several, and its no counts as far as it shows the person.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.heat_maps import own_regions
from gait_segmentation.images import count_likely, distance_from, shifted_part
from gait_segmentation.scene.scene import Shift, ShownHeat
from gait_segmentation.tracking.cues import Cue, CueInput, Evidence
from gait_segmentation.tracking.pixels import beyond
from gait_segmentation.tracking.state import State

_WRONG = 0.03
"""Probability that a map is wrong though it is certain, which limits the evidence."""

_MISSED, _COVERED = 0.5, 0.8
"""
Share of a person up to which a map misses them, so that it says nothing where it shows nobody, and
from which it shows them.
"""

_ONE, _TWO = 1.25, 1.75
"""Area of a region, over that of the person, up to which it is one's and from which several'."""

_CHANGE = 0.03
"""How far off a map may be for each frame that it is old, in body heights."""

_LEAST_FLOW_PX = 24
"""Shorter side of a window in which limbs can be followed, in pixels."""


class HeatMapCue(Cue):
    """What a heat map says of one person."""

    shown = 0.0
    """Share of the person that the last map showed."""

    def evidence(self, given: CueInput) -> Evidence | None:
        """Return the evidence of the last mask and the map, see :meth:`Cue.evidence`."""
        told = [each for each in (_mask(given), _map(given)) if each is not None]
        if not told:
            return None
        first, *rest = (self._evidence(given, *each) for each in told)
        return Evidence(sum(rest, start=first))

    def _evidence(
        self, given: CueInput, heat: ShownHeat, state: State, moved: Shift
    ) -> NDArray[np.float32]:
        """
        Return log-likelihood ratios of the window's pixels, (h, w) float32.

        :param heat: a map of the window.
        :param state: that of the frame it was made of.
        :param moved: how far the body went since.
        """
        (values, frames, trust), height = heat, given.pose.height
        if frames:
            values = _carried(values, given, state, moved)
            side = 2 * round(_CHANGE * frames * height) + 1
            values = np.asarray(cv2.blur(values, (side, side)))
        own = own_regions(values, given.expected)
        person = np.where(given.logit > 0, given.expected, 0)
        self.shown = shown = count_likely(cv2.min(own, person)) / max(count_likely(person), 1)
        area, usual = count_likely(own), max(given.usual_area * height**2, 1.0)
        others = max(area - _ONE * usual, 0.0) / max(own.size - usual, 1.0)
        found = map_evidence(own, trust, shown, others)
        several = np.clip((area / usual - _ONE) / (_TWO - _ONE), 0, 1)
        several = np.float32(max(several, 1 - covered(shown)))
        if several:
            # Then only what is where the person is expected need be theirs.
            away = beyond(distance_from(given.expected > 127), height / 2)
            found *= np.where(found > 0, 1 - several * away, 1)
        return found


def _mask(given: CueInput) -> tuple[ShownHeat, State, Shift] | None:
    """Return what a network has drawn of this person alone."""
    if given.drawn is None:
        return None
    mask, state = given.drawn
    then_ns, moved = state.frame.image.stamp_ns, given.moved(state)
    frames = sum(each.frame.image.stamp_ns > then_ns for each in given.states)
    return ShownHeat(mask.drawn(given.window, given.view.scale, moved), frames, 1.0), state, moved


def _map(given: CueInput) -> tuple[ShownHeat, State, Shift] | None:
    """Return what a heat map shows in the window."""
    heat = given.view.heat
    if heat is None or not heat.trust:
        return None
    state = given.states[max(-1 - heat.frames, -len(given.states))]
    x, y = moved = given.moved(state)
    values = shifted_part(heat.values, round(x), round(y), given.window)
    return heat._replace(values=values), state, moved


def _carried(
    values: NDArray[np.uint8], given: CueInput, state: State, moved: Shift
) -> NDArray[np.uint8]:
    """
    Return a map of an earlier frame as what it shows has moved since, by optical flow.

    :param values: (h, w) uint8 of the window, gone along with the body.
    """
    if min(values.shape) < _LEAST_FLOW_PX:
        return values
    x, y = moved
    then = shifted_part(state.frame.image.gray, round(x), round(y), given.window)
    now = given.view.now.image.gray[given.window]
    flow = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM).calc(
        np.ascontiguousarray(now), np.ascontiguousarray(then), None
    )
    rows, columns = np.indices(values.shape, np.float32)
    x_then, y_then = columns + flow[..., 0], rows + flow[..., 1]
    return np.asarray(cv2.remap(values, x_then, y_then, cv2.INTER_LINEAR))


def covered(shown: float) -> float:
    """Return how far a map that shows some share of a person shows them, 0 to 1."""
    return float(np.clip((shown - _MISSED) / (_COVERED - _MISSED), 0, 1))


def map_evidence(
    values: NDArray[np.uint8], trust: float, shown: float = 1.0, others: float = 0.0
) -> NDArray[np.float32]:
    """
    Return the log-likelihood ratios of a person by a map, (h, w) float32.

    :param values: (h, w) uint8, P(person).
    :param trust: how far the map counts, 0 to 1.
    :param shown: share of the person that it shows.
    :param others: share of what is not the person that is of other people.
    """
    likely = np.arange(256) / 255
    ratio = np.log((likely + _WRONG) / (1 - likely + others * likely + _WRONG))
    table = trust * np.where(ratio < 0, covered(shown) * ratio, ratio)
    return np.asarray(cv2.LUT(values, table.astype(np.float32)))

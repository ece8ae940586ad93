# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The tracker of this package: colours, background and other cues, learnt from the masks."""

from __future__ import annotations

from collections import deque
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.detector.detection import Detection, SoftMask
from gait_segmentation.geometry import BodyFrame, Box, body_window
from gait_segmentation.images import (
    Window,
    bounding_box,
    count_likely,
    distance_from,
    placed,
    shrink,
)
from gait_segmentation.results import LOST, TRACKED, Feedback
from gait_segmentation.scene.scene import MOST_KEPT, Frame, View
from gait_segmentation.starting import FirstMask
from gait_segmentation.tracking.appearance import (
    SURELY_SAME,
    Appearance,
    colour_signature,
    similarity,
)
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.cues import CueInput
from gait_segmentation.tracking.cues.heat_map import HeatMapCue
from gait_segmentation.tracking.cues.motion import MotionCue
from gait_segmentation.tracking.cues.sighting import SightingCue
from gait_segmentation.tracking.likelihood import Colours, log_ratio, place_shown
from gait_segmentation.tracking.pixels import (
    ALONE,
    GUARD,
    LEAST_SEEN,
    PixelClaim,
    Visibility,
    beyond,
)
from gait_segmentation.tracking.pose import Pose
from gait_segmentation.tracking.state import Place, Silhouette, State
from gait_segmentation.tracking.track import WHOLE, Track

_AREA_RATE = 0.02
"""
Share by which the usual area moves towards that of a mask: of one of all of the person or not, or
nothing would be learnt after a first mask that was far too large.
"""

_MOST_SEEN = 4.0
"""Size of a mask, over that of the template, from which it is of more than the person."""

_MOVES = 0.01
"""Least share of a person's pixels that move, seen over some frames, though they stand."""

_UNLIKE = 0.9
"""Similarity of the colours below which they are not those of who moved: people change little."""

_MASK_MARGIN = 0.02
"""How far a mask may be off, in body heights: so far about it no background is learnt."""

_PLACE = 'place'
"""Name of the note of where a frame showed the place as it is known."""


class FusionTrack(Track):
    """
    One person, known by the masks that come back.

    ``mask`` is the last one of all of the person and ``template`` that which came with it;
    ``visible`` is what can be followed of the very last mask, and ``full`` the last one of a
    person whom no border cuts, who is looked for by it.  A mask that comes late corrects the pose
    by what it shows in its own frame, from which on the body went as it did.
    """

    appearance: Appearance

    def __init__(
        self,
        track_id: int,
        view: View,
        start: FirstMask,
        config: TrackingConfig,
        **known: Any,
    ) -> None:
        """Begin with the first mask, in the newest frame of a view; see the base class."""
        pose = Pose.of(start.body, start.box, start.body.angle if config.use_tilt else 0.0)
        super().__init__(track_id, view, pose, config, **known)
        self._drawn: tuple[SoftMask, State] | None = None
        self._moving_looks: deque[NDArray[np.float32]] = deque(maxlen=MOST_KEPT)
        self.mask = self.visible = Silhouette(start.mask, self.displacement)
        self.full: Silhouette = self.mask
        self.template: Silhouette | None = None
        self._usual_area = self._area_of(start.mask)
        self.colours = Colours(config)
        # What may be either counts for both, so that a leg missed at first can still be found.
        inside = np.ascontiguousarray(start.votes[self.window])
        outside = cv2.erode(1 - inside, np.ones((3, 3), np.uint8))
        lab, rows = view.now.image.lab_part(self.window), self.pose.rows(self.window)
        self.colours.learn(lab, rows, (inside, outside), (1.0, 1.0))
        self.heat_map = HeatMapCue()
        self.motion = MotionCue()
        self.sighting = SightingCue()
        self.cues = (self.motion, self.heat_map, self.sighting)
        self.appearance = Appearance(self._signature(start.mask, view.now, self.window))

    def expected_mask(self) -> NDArray[np.uint8]:
        """Return the last mask, moved along with the body."""
        mask = self.full if self.state == LOST else self.mask
        return mask.at(self.displacement, self.window)

    def silhouette(self) -> NDArray[np.uint8]:
        """Return what was seen of the person last, moved along with the body."""
        return self.visible.at(self.displacement, self.window)

    def claim(self) -> PixelClaim | None:
        """Judge pixels by all cues."""
        pose, view, config, seen = self.pose, self.view, self.config, self.state == TRACKED
        window = self.window
        if self.is_outside:
            return None
        expected, lab = self.expected_mask(), view.now.image.lab_part(window)
        away = distance_from(expected > 127)
        template = strangers = None
        if self.template is not None:
            template = self.template.at(self.displacement, window)
            strangers = np.float32(config.foreground_density) * beyond(away, pose.height)
        place = place_shown(view.background, lab, window, config)
        logit = log_ratio(lab, pose.rows(window), place, self.colours, config, strangers)
        self.history.note(_PLACE, window, place.confirmed(lab, config.shadow_floor))
        body, area = expected if template is None else template, self._usual_area
        # Each cue sees what those before it have added to the ratio.
        drawn = self._drawn_of_late()
        given = CueInput(
            view, self.history.states, pose, window, body, logit, seen, area, config, drawn
        )
        for cue in self.cues:
            evidence = cue.evidence(given)
            if evidence is not None:
                logit += evidence.logit
                if evidence.values is not None:
                    self.history.note(type(cue).__name__, window, evidence.values)
        # Those who are not published are taken to be hidden by others: no mask is cut for them.
        vague = self.slot is None and not self._outlined
        hidden = not seen or self.slot is None
        return PixelClaim(
            window, logit, expected, away, pose.feet, pose.height, hidden, template, vague
        )

    def _drawn_of_late(self) -> tuple[SoftMask, State] | None:
        """Return the newest mask by a network, and its state, None if it is too old to count."""
        if self._drawn is None:
            return None
        age_ns = self.view.now.image.stamp_ns - self._drawn[1].frame.image.stamp_ns
        return self._drawn if age_ns <= 1e9 * self.config.heat_map_age else None

    def see(self, detection: Detection, stamp_ns: int) -> None:
        """Take in where a detector saw the person."""
        super().see(detection, stamp_ns)
        self._see_in(detection.box, self.history.place_at(stamp_ns))

    def _see_in(self, box: Box, place: Place) -> None:
        if self.config.use_sightings:
            self.sighting.see(box.scaled(self.view.scale), place)

    def take_mask(self, mask: SoftMask | None, box: Box) -> None:
        """Take in what a network has drawn of the person; see the base class."""
        super().take_mask(mask, box)
        if mask is None:
            return
        if self.existence.motion < 1:
            share = box.height / max(self.view.source)
            self.existence = self.existence.drawn(mask.presence, share)
        shown = mask.box if mask.fits(box) else None
        if shown is None and mask.box is not None and not self.is_on(mask):
            # Somebody comes near of whom nothing is known yet.
            return
        now = self.history.states[-1]
        self._drawn, self._outlined = (mask, now), True
        if self.sighting.newest != now.place:
            self._see_in(shown or box, now.place)
        if self.existence.moved_ns is None:
            self._uncover(mask)

    def drawn_now(self) -> SoftMask | None:
        """Return what a network has drawn of them in the newest frame, None if none did."""
        drawn, now = self._drawn, self.history.states[-1]
        return drawn[0] if drawn is not None and drawn[1] is now else None

    def _uncover(self, mask: SoftMask) -> None:
        """Forget what was learnt of the place where somebody stood who is drawn there now."""
        view, window = self.view, self.window
        lab = view.now.image.lab_part(window)
        known = view.background.within(window).evidence(lab, self.config.shadow_floor)
        there = mask.drawn(window, view.scale, (0.0, 0.0)) > 127
        alike = np.where(there & (known < 0), np.uint8(255), np.uint8(0))
        view.background.forget(placed(alike, window, view.shape))

    def detected_in(self, stamp_ns: int) -> Box:
        """Return where a detector saw them last; see the base class."""
        box = self.sighting.box_in(self.history.place_at(stamp_ns))
        return super().detected_in(stamp_ns) if box is None else box.scaled(1 / self.view.scale)

    def observe(
        self, likelihood: NDArray[np.uint8], claim: PixelClaim, occluder: NDArray[np.uint8] | None
    ) -> None:
        """See how well the person stands out, and whether they move; see the base class."""
        super().observe(likelihood, claim, occluder)
        if self.seen >= LEAST_SEEN:
            self._see_motion(likelihood[claim.window], claim)

    def _see_motion(self, values: NDArray[np.uint8], claim: PixelClaim) -> None:
        """Take in whether what is likely, (h, w) uint8 of the claim's window, moves."""
        if not self.config.use_stillness:
            return
        stamp_ns, moving = self.view.now.image.stamp_ns, self.motion.moving
        if moving is None:
            return
        if moving >= _MOVES:
            self.existence = self.existence.moving(stamp_ns, self.motion.lasting)
            self._moving_looks.append(self.appearance.last)
        elif self._moving_looks and self.existence.is_at_rest(stamp_ns):
            there = np.where(values > 127, claim.mask, np.uint8(0))
            likely = placed(there, claim.window, self.view.shape)
            looks = self._signature(likely, self.view.now, claim.window)
            # What covers somebody, as a door does, becomes theirs frame by frame: what counts is
            # what they looked like before that.
            alike = similarity(self._moving_looks[0], looks) >= _UNLIKE
            self.existence = self.existence.resting(alike=alike)

    def enter(self, state: str, reason: str) -> None:
        """Go over to a state; of who is lost no template is known."""
        super().enter(state, reason)
        if state == LOST:
            self.template = None

    def find(self, values: NDArray[np.uint8], visibility: Visibility, claim: PixelClaim) -> None:
        """Take in that a lost person is seen where the expected mask is, and follow that."""
        expected = placed(claim.mask, claim.window, self.view.shape)
        self.mask = self.visible = Silhouette(expected, self.displacement)
        super().find(values, visibility, claim)
        self._see_motion(values, claim)

    def looks_alike(self, mask: NDArray[np.uint8]) -> bool:
        """Return whether the colours in a mask are those of the person."""
        return self.appearance.is_like(self._signature(mask, self.view.now, self.window))

    def log_ratio(
        self, lab: NDArray[np.uint8], rows: NDArray[np.float32], window: Window
    ) -> NDArray[np.float32]:
        """Return ln p(person) / p(surroundings); see :func:`.likelihood.log_ratio`."""
        place = self.view.background.within(window)
        return log_ratio(lab, rows, place, self.colours, self.config)

    @property
    def shown(self) -> float:  # type: ignore[override]
        """Return the share of the person that the last heat map showed."""
        return self.heat_map.shown

    def similarity(self, start: FirstMask, frame: Frame) -> float:
        """Return how alike (0..1) the colours of a first mask in some frame are."""
        body = start.body
        area = body_window(body.center_x, body.center_y, body.height)
        window = area.slices(*start.mask.shape[::-1])
        rows = Pose.of(body, start.box).rows(window)
        signature = colour_signature(frame.image.lab_part(window), start.mask[window], rows)
        return self.appearance.similarity(signature)

    def fade(self, chroma: float) -> None:
        """Go on as if all that is known of the colours had the same a* and b*."""
        self.colours.fade(chroma)
        self.appearance.fade(chroma)

    def correct(
        self, state: State, feedback: Feedback | None, *, alone: bool
    ) -> tuple[Window, Window, NDArray[np.uint8]] | None:
        """
        Learn from the mask of a frame; see :meth:`Track.correct`.

        Nothing is learnt of colours, size and look from a mask that shows only part of a person
        who is not at the border, but the person is followed by that part.
        """
        if feedback is None or self.state == LOST:
            return None
        mask, template = working_masks(feedback, self.view.shape)
        self.visible = Silhouette(mask, state.displacement)
        if not self._is_person(mask, template):
            return None
        # To where the body was in that frame.
        (x, y), (to_x, to_y) = state.displacement, self.displacement
        dx, dy = to_x - x, to_y - y
        self.pose = self.pose.shifted(-dx, -dy)
        window, height = self.window, self.pose.height
        whole = self._shows_all(mask)
        if whole:
            self.mask = self.visible
            self.template = Silhouette(template, state.displacement)
            body = None if feedback.body is None else feedback.body.scaled(self.view.scale)
            about = grown(mask, height)
            self._learn(state, window, mask, template, body)
        else:
            # What the person uncovers meanwhile is learnt, or it would trail behind.
            where = np.zeros(self.view.shape, np.uint8)
            known = self.mask.at(state.displacement, window) | mask[window]
            where[window] = known | cv2.inRange(template[window], 128, 255)
            about = grown(where, height)
        self.pose = self.pose.shifted(dx, dy)
        return (window, *about) if whole or alone else None

    def _learn(
        self,
        state: State,
        window: Window,
        mask: NDArray[np.uint8],
        template: NDArray[np.uint8],
        body: BodyFrame | None,
    ) -> None:
        """
        Learn from a mask of all of the person in the frame of a state, with the pose of then.

        The person's colours are those of the mask near the template, outside of which they must
        not look as the surroundings do there, or as a shadow on them: a mask that takes in the
        shadow at the feet would teach that it is the person's, and take in more of it.  The
        surroundings' are those that do not touch the mask.

        :param template: (H, W) uint8, above 127 on the body; without a body: not known.
        :param body: the matched body in working pixels.
        """
        frame, config = state.frame, self.config
        for cue in self.cues:
            noted = state.notes.get(type(cue).__name__)
            if noted is not None:
                cue.calibrate(noted[1], mask[noted[0]])
        lab = frame.image.lab_part(window)
        part, near = mask[window], template[window] > 127
        inside = part > 127
        if (known := state.noted(_PLACE)) is not None:
            inside &= near | (known[window] == 0)
        if near.any():
            inside &= distance_from(near) < GUARD * self.pose.height
        outside = cv2.dilate(part, np.ones((3, 3), np.uint8)) <= 127
        rows, rates = self.pose.rows(self.window), (config.person_colour_rate, config.colour_rate)
        self.colours.learn(lab, rows, (inside, outside), rates)
        self.pose = self.pose.fitted(mask, body)
        if config.use_tilt:
            self.pose = self.pose.tilted(mask)
        self.appearance.add(self._signature(mask, frame, self.window))
        if self.appearance.similarity(self.appearance.last) >= SURELY_SAME:
            self.usual_ns = frame.image.stamp_ns
        if self.pose.share_inside(mask.shape) > ALONE:
            self.full = self.mask

    def _signature(
        self, mask: NDArray[np.uint8], frame: Frame, window: Window
    ) -> NDArray[np.float32]:
        """Return what the person looks like in a mask of a frame, see ``colour_signature``."""
        return colour_signature(frame.image.lab_part(window), mask[window], self.pose.rows(window))

    def _shows_all(self, mask: NDArray[np.uint8]) -> bool:
        """Get used to the size of a mask; return whether it was large enough for all of them."""
        area = self._area_of(mask)
        share = area / max(self._usual_area, 1e-6)
        self._usual_area += _AREA_RATE * (area - self._usual_area)
        return share >= WHOLE

    def _area_of(self, mask: NDArray[np.uint8]) -> float:
        """Return the area of a mask in squared body heights, made up for what is outside."""
        inside = max(self.pose.share_inside(mask.shape), 0.1)
        return count_likely(mask) / (inside * self.pose.height**2)

    def _is_person(self, mask: NDArray[np.uint8], template: NDArray[np.uint8]) -> bool:
        """Return whether a mask is of the size of a person, beside the template."""
        area, expected = cv2.countNonZero(mask[self.window]), count_likely(template[self.window])
        return max(LEAST_SEEN * expected, 9) < area < _MOST_SEEN * max(expected, 9)


def working_masks(
    feedback: Feedback, shape: tuple[int, int]
) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Return mask (0/255) and template at working size, (h, w) uint8, for the tracker alone."""
    mask, prior = feedback.mask, feedback.shape_prior
    # They are kept, and who else has them may draw on them.
    if mask.shape == shape:
        mask = mask.copy()
    else:
        mask = np.asarray(cv2.threshold(shrink(mask, shape), 127, 255, cv2.THRESH_BINARY)[1])
    if prior.shape == shape:
        return mask, prior.copy()
    return mask, np.asarray(cv2.resize(prior, shape[::-1], interpolation=cv2.INTER_LINEAR))


def grown(mask: NDArray[np.uint8], height: float) -> tuple[Window, NDArray[np.uint8]]:
    """
    Return a mask with a margin, where the person may be: a window and what is in it.

    :param mask: (h, w) uint8.
    :param height: of the body in pixels.
    """
    size = 2 * max(1, round(_MASK_MARGIN * height)) + 1
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    x, y, width, tall = bounding_box(mask)
    part = (
        slice(max(y - size, 0), min(y + tall + size, mask.shape[0])),
        slice(max(x - size, 0), min(x + width + size, mask.shape[1])),
    )
    return part, np.asarray(cv2.dilate(mask[part], kernel))

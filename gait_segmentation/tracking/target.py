# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One tracked person in a world: judged, followed, learnt, lost and found again."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.colour import body_rows, colour_bins
from gait_segmentation.geometry import Box, body_window
from gait_segmentation.images import Window, shift_whole, shrink
from gait_segmentation.results import LOST, TRACKED, Feedback, TrackResult
from gait_segmentation.starting import Start
from gait_segmentation.tracking.appearance import Appearance, colour_signature
from gait_segmentation.tracking.competition import Claim
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.cues import add_motion, add_propagation
from gait_segmentation.tracking.ego_motion import Motion
from gait_segmentation.tracking.features import STEP, FeatureSelector, View
from gait_segmentation.tracking.likelihood import colour_log_ratio, likelihood_image, log_ratio
from gait_segmentation.tracking.mean_shift import mean_shift
from gait_segmentation.tracking.person import Person, extent_of, new_colours
from gait_segmentation.tracking.search import find_silhouette
from gait_segmentation.tracking.world import Record, World

__all__ = ['SAME_COLOURS', 'Target']

_LEAST_MOTION = 0.02
"""Motion of the body relative to the world that the cue needs, in body heights."""

_STILL = -0.5
"""Evidence from motion below which a pixel stays with the world."""

_FAR_OUTSIDE = 0.06
"""How far outside of the template such a pixel is not the person's, in body heights."""

_DILATION = 0.02
"""Margin about the mask that is not learnt as background, in body heights."""

_LOST_BELOW = 0.25
"""Share of a person that can be seen below which the person is lost."""

_LOST_FRAMES = 2
"""Frames in a row that it takes."""

_WELL = 0.75
"""Share that can be seen from which a body is followed and learnt from."""

_USUAL_SHARE, _USUAL_RATE = 0.8, 0.05
"""Share of what is usually seen that will do, too, and how fast that is learnt."""

_FOUND_SHARE, _FOUND_INSIDE, _FOUND_CONTRAST = 0.3, 0.5, 0.35
"""What somebody lost must show to be found: uncovered share, likelihood, and contrast."""

SAME_COLOURS = 0.65
"""Least similarity of the colours of somebody found again."""

_SEARCH_HEIGHT = 32
"""Height of the body in the image that is searched, in pixels."""

_SEARCH_SCORE = 0.3
_COAST_S, _STOP_S = 1.0, 0.5
"""Time for which a hidden person is taken to walk on, and in which they are then to stop."""

_REACH_X, _REACH_X_RATE = 0.5, 1.5
_REACH_Y, _REACH_Y_RATE = 0.2, 0.2
"""How far from the expected place somebody is looked for, in body heights, and per second."""

_REACH = 0.7
"""How far about the middle of the body the window may reach, in body heights."""

_CRUISE_RATE = 0.15
_AREA_RATE = 0.03
_BEYOND = 0.3
"""How far beyond the border somebody who left is waited for, in body heights."""

_LOOK_EVERY = 3
"""Masks of which one is looked at for what the person looks like."""

_WHOLLY = 0.95
"""Share of the body inside the image from which a mask shows all of it."""

_BOX_MARGIN = 0.04
"""How far from the last mask, carried along, pixels still make the box, in body heights."""

_THIN = (slice(None, None, STEP), slice(None, None, STEP))

Likelihood = NDArray[np.uint8]


@dataclass(frozen=True)
class _Silhouette:
    """
    A mask cut out, which can be laid anywhere, even where part of it is outside of the image.

    ``left`` and ``top`` are where it begins relative to the centre of the body, in pixels.
    """

    mask: NDArray[np.uint8]
    left: int
    top: int

    @classmethod
    def of(cls, mask: NDArray[np.uint8], person: Person) -> _Silhouette:
        """Cut out the mask of a person."""
        x, y, width, height = cv2.boundingRect(mask)
        part = mask[y : y + height, x : x + width].copy()
        return cls(part, x - round(person.center_x), y - round(person.center_y))

    @property
    def middle(self) -> tuple[float, float]:
        """Return the middle of the cut-out relative to the centre of the body."""
        return self.left + self.mask.shape[1] / 2, self.top + self.mask.shape[0] / 2

    def placed(self, person: Person, shape: tuple[int, int]) -> NDArray[np.uint8]:
        """Return the mask of an image of the given (h, w) with the person where it is now."""
        out = np.zeros(shape, np.uint8)
        left, top = round(person.center_x) + self.left, round(person.center_y) + self.top
        height, width = self.mask.shape
        x0, y0 = max(left, 0), max(top, 0)
        x1, y1 = min(left + width, shape[1]), min(top + height, shape[0])
        if x0 < x1 and y0 < y1:
            out[y0:y1, x0:x1] = self.mask[y0 - top : y1 - top, x0 - left : x1 - left]
        return out


class Target:
    """
    A person in one slot.

    ``state`` is tracked or lost.  Somebody lost is taken to walk on for a while and then to wait;
    nothing is learnt of them meanwhile, and they are looked for: where they are expected, then
    all over the image.
    """

    def __init__(self, track_id: int, world: World, start: Start, config: TrackingConfig) -> None:
        """Begin with the first mask, in the world's newest frame."""
        self.track_id = track_id
        self.world = world
        self.config = config
        self.state = TRACKED
        self.confidence = 0.0
        self.lost_s = 0.0
        self.person = Person(
            track_id,
            start.body.center_x,
            start.body.center_y,
            start.body.height,
            max(start.body.center_x - start.box.x, 1.0),
            max(start.box.right - start.body.center_x, 1.0),
            start.mask,
            *new_colours(config),
        )
        if config.use_tilt:
            self.person.tilt = self.person.angle = start.body.angle
        self.features = FeatureSelector()
        if config.use_feature_selection:
            window = self.person.window(world.shape)
            self.features.learn(_view(world.now, window), start.mask[window], 1.0)
        self.person.learn_colours(world.now.image.lab, start.mask, None, 1.0)
        world.now.bodies[track_id] = (0.0, 0.0)
        self._first = True
        self._area = self._area_of(start.mask)
        self._seen = 1.0
        self._unseen_frames = 0
        self._usually_seen = 1.0
        self._cruise = (0.0, 0.0)
        self._box: Box | None = None
        self._learnt = 0
        self._appearance = Appearance()
        self._appearance.learn(self._signature(start.mask, world.now))
        self._silhouette = _Silhouette.of(start.mask, self.person)

    @property
    def box(self) -> Box:
        """Return the box about what can be seen, in source pixels."""
        return self._box if self._box is not None else self.body

    @property
    def body(self) -> Box:
        """Return the box of the whole body in source pixels, in the frame of the body."""
        return self.person.box.scaled(1 / self.world.scale)

    @property
    def feet(self) -> float:
        """Return the row of the soles in working pixels: the lower, the nearer."""
        return self.person.center_y + self.person.height / 2

    def meets(self, other: Target) -> bool:
        """Return whether another person may be in the way of this one, or the other way round."""
        one, two = self.person, other.person
        reach = _REACH * (one.height + two.height)
        return (
            abs(one.center_x - two.center_x) < reach and abs(one.center_y - two.center_y) < reach
        )

    def carried_mask(self) -> NDArray[np.uint8]:
        """Return the last mask, carried along with the body."""
        if self.state == LOST:
            return self._silhouette.placed(self.person, self.world.shape)
        return _shifted(self.person.mask, *self.world.since_mask(self.track_id))

    # Each frame: move, judge, assess, and if lost, recover.

    def move(
        self, motion: Motion, body: NDArray[np.uint8], cover: NDArray[np.uint8] | None
    ) -> None:
        """
        Follow the body into the world's newest frame.

        :param motion: of the camera.
        :param body: the mask carried to the frame before.
        :param cover: non-zero where others hid it there.
        """
        person = self.person
        x, y = motion.carry(person.center_x, person.center_y)
        world = (x - person.center_x, y - person.center_y)
        seconds = self.world.step_s
        if self.state == LOST:
            shift = self._coast(world, seconds)
        else:
            shift = self._follow(world, seconds, body, cover)
        self.world.now.bodies[self.track_id] = shift

    def _follow(
        self,
        world: tuple[float, float],
        seconds: float,
        body: NDArray[np.uint8],
        cover: NDArray[np.uint8] | None,
    ) -> tuple[float, float]:
        person = self.person
        visible = body if cover is None else cv2.bitwise_and(body, cv2.bitwise_not(cover))
        measured = None
        if self._well_seen:
            measured = self.world.body_shift(visible)
        if measured is None:
            # Also because the edge of what hides the person moves otherwise.
            person.velocity = (self._cruise[0] * seconds, self._cruise[1] * seconds)
        shift = person.predict(world, measured)
        if measured is not None and seconds > 0:
            new = ((shift[0] - world[0]) / seconds, (shift[1] - world[1]) / seconds)
            self._cruise = (
                self._cruise[0] + _CRUISE_RATE * (new[0] - self._cruise[0]),
                self._cruise[1] + _CRUISE_RATE * (new[1] - self._cruise[1]),
            )
        return shift

    def _coast(self, world: tuple[float, float], seconds: float) -> tuple[float, float]:
        """Walk on unseen, ever slower, and wait at the border of the image."""
        person = self.person
        self.lost_s += seconds
        share = math.exp(-max(self.lost_s - _COAST_S, 0.0) / _STOP_S)
        dx = world[0] + share * seconds * self._cruise[0]
        dy = world[1] + share * seconds * self._cruise[1]
        height, width = self.world.shape
        beyond = _BEYOND * person.height
        dx = min(max(person.center_x + dx, -beyond), width + beyond) - person.center_x
        dy = min(max(person.center_y + dy, -beyond), height + beyond) - person.center_y
        person.shift(dx, dy)
        return dx, dy

    def judge(self) -> Claim | None:
        """Judge the pixels in a window about the person, None if all of it is outside."""
        config, person, record = self.config, self.person, self.world.now
        window = person.window(self.world.shape)
        if window[0].start >= window[0].stop or window[1].start >= window[1].stop:
            return None
        lab = np.ascontiguousarray(record.image.lab_about(window)[window])
        bins, rows = colour_bins(lab), person.rows(window)
        logit = log_ratio(
            lab,
            bins,
            rows,
            window,
            record.background,
            person.person,
            person.surroundings,
            config,
        )
        still = np.ascontiguousarray(logit[_THIN]) if config.use_feature_selection else logit
        if config.use_motion_cue and self.state == TRACKED:
            self._add_motion(logit, record, window)
        expected = self.carried_mask()
        if config.use_feature_selection:

            def evidence() -> dict[str, NDArray[np.float32]]:
                colour = colour_log_ratio(
                    np.ascontiguousarray(bins[_THIN]),
                    np.ascontiguousarray(rows[_THIN]),
                    person.person,
                    person.surroundings,
                    config.logit_limit,
                )
                motion = logit[_THIN] - still
                return {'colour': colour, 'background': still - colour, 'motion': motion}

            known = expected[window] if self.state == TRACKED else None
            self.features.add(logit, _view(record, window), known, evidence)
        if config.use_propagation or self._first:
            add_propagation(logit, expected, window, person.height, config.propagation_weight)
        self._first = False
        return Claim(window, logit, expected, self.feet, person.height, self.state == LOST)

    def assess(
        self,
        likelihood: Likelihood,
        window: Window,
        mask: NDArray[np.uint8],
        cover: NDArray[np.uint8] | None,
    ) -> None:
        """
        See how well the person stands out, and refine the place by mean shift.

        :param likelihood: (h, w) uint8 of the working image.
        :param mask: where the person is expected.
        :param cover: non-zero where others hide the person.
        """
        values, reference = likelihood[window], mask[window]
        uncovered = reference
        share = 1.0
        if cover is not None:
            uncovered = cv2.bitwise_and(reference, cv2.bitwise_not(cover[window]))
            share = _ratio(uncovered, reference)
        inside = cv2.mean(values, uncovered)[0] / 255
        outside = cv2.mean(values, cv2.bitwise_not(reference))[0] / 255
        self._seen = share * inside
        self._usually_seen += _USUAL_RATE * (self._seen - self._usually_seen)
        self.confidence = share * max(0.0, inside - outside)
        if self._seen < _LOST_BELOW or self._inside_image() < _LOST_BELOW / 2:
            self._unseen_frames += 1
            if self._unseen_frames >= _LOST_FRAMES:
                self.lose()
            return
        self._unseen_frames = 0
        if self._well_seen:
            self._mean_shift(values, uncovered, window)
        self._box = self._box_of(values, uncovered, window)

    @property
    def _well_seen(self) -> bool:
        """Return whether all of the person was seen, or as much as usual."""
        return self._seen >= min(_WELL, _USUAL_SHARE * self._usually_seen)

    def lose(self) -> None:
        """Give the person up for lost."""
        self.state = LOST
        self.lost_s = 0.0
        self._unseen_frames = 0
        self._box = None

    def _mean_shift(
        self, values: NDArray[np.uint8], reference: NDArray[np.uint8], window: Window
    ) -> None:
        person, record = self.person, self.world.now
        box = person.box.shifted(-window[1].start, -window[0].start)
        shift = mean_shift(
            values,
            reference,
            (round(box.x), round(box.y), max(round(box.width), 1), max(round(box.height), 1)),
        )
        gain = self.config.mean_shift_gain
        limit = 0.05 * person.height
        dx = gain * min(max(shift.dx, -limit), limit)
        dy = gain * min(max(shift.dy, -limit), limit)
        self._shift_now(record, dx, dy)
        if len(self.world.pending) > 1:
            # The last mask is not of the last frame: until a newer one comes, this is the size.
            person.follow_scale(shift.scale)

    def _shift_now(self, record: Record, dx: float, dy: float) -> None:
        """Correct the place in the newest frame."""
        self.person.shift(dx, dy)
        body = record.bodies[self.track_id]
        record.bodies[self.track_id] = (body[0] + dx, body[1] + dy)

    def _inside_image(self) -> float:
        """Return the share of the body's box that lies in the image."""
        box = self.person.box
        part = box.clipped(self.world.shape[1], self.world.shape[0])
        return 0.0 if part is None else part.width * part.height / (box.width * box.height)

    def _box_of(
        self, values: NDArray[np.uint8], mask: NDArray[np.uint8], window: Window
    ) -> Box | None:
        """Return the tight box of the likely pixels near the mask, in source pixels."""
        size = 2 * max(1, round(_BOX_MARGIN * self.person.height)) + 1
        near = cv2.dilate(mask, np.ones((size, size), np.uint8))
        likely = np.where(values > 127, near, 0).astype(np.uint8)
        if np.count_nonzero(likely) < _LOST_BELOW * np.count_nonzero(mask):
            return None
        extent = extent_of(likely, (0.0, 0.0), 0.0)
        box = Box(
            window[1].start + extent.left,
            window[0].start + extent.top,
            extent.right - extent.left,
            extent.bottom - extent.top,
        )
        return box.scaled(1 / self.world.scale)

    def recover(
        self, claim: Claim | None, likelihood: Likelihood | None, taken: NDArray[np.uint8]
    ) -> Likelihood | None:
        """
        Look for the person who is lost: where expected, then all over the image.

        :param claim: what was judged where the person is expected, and the likelihood after
            competing with others; None if that is outside.
        :param taken: non-zero where others are.
        :returns: the likelihood if the person was found; the state is then tracked.
        """
        if claim is not None and likelihood is not None and self._shows(claim, likelihood, taken):
            return likelihood
        place = self._search(taken)
        if place is None:
            return None
        record = self.world.now
        before = (self.person.center_x, self.person.center_y)
        body = record.bodies[self.track_id]
        self._shift_now(record, place[0], place[1])
        claim = self.judge()
        if claim is not None:
            likelihood = likelihood_image(claim.logit, claim.window, self.world.shape)
            likelihood[taken > 0] = 0
            if self._shows(claim, likelihood, taken):
                return likelihood
        self.person.center_x, self.person.center_y = before
        record.bodies[self.track_id] = body
        return None

    def _shows(self, claim: Claim, likelihood: Likelihood, taken: NDArray[np.uint8]) -> bool:
        """Return whether the person, and nobody else, can be seen at the place."""
        window = claim.window
        if self._inside_image() < _LOST_BELOW:
            return False
        values, mask, rivals = likelihood[window], claim.mask[window], taken[window]
        uncovered = cv2.bitwise_and(mask, cv2.bitwise_not(rivals))
        share = _ratio(uncovered, mask)
        inside = cv2.mean(values, uncovered)[0] / 255
        around = cv2.bitwise_not(cv2.bitwise_or(mask, rivals))
        outside = cv2.mean(values, around)[0] / 255
        self.confidence = share * max(0.0, inside - outside)
        if share < _FOUND_SHARE or inside < _FOUND_INSIDE or inside - outside < _FOUND_CONTRAST:
            return False
        full = np.zeros(self.world.shape, np.uint8)
        full[window] = np.where(values > 127, uncovered, 0)
        if self._appearance.similarity(self._signature(full, self.world.now)) < SAME_COLOURS:
            return False
        dx, dy = self.world.since_mask(self.track_id)
        self.person.mask = _shifted(claim.mask, -dx, -dy)
        self.state = TRACKED
        self._seen = share * inside
        self._box = self._box_of(values, uncovered, window)
        return True

    def _signature(self, mask: NDArray[np.uint8], record: Record) -> NDArray[np.float32]:
        window = self.person.window(self.world.shape)
        lab = record.image.lab_about(window)[window]
        return colour_signature(lab, mask[window], self.person.rows(window))

    def likeness(self, world: World, start: Start) -> float:
        """Return how alike (0..1) the colours of a first mask in a world's newest frame are."""
        body, shape = start.body, world.shape
        window = body_window(body.center_x, body.center_y, body.height).slices(shape[1], shape[0])
        lab = world.now.image.lab_about(window)[window]
        part = start.mask[window]
        origin = (window[1].start, window[0].start)
        rows = body_rows(part.shape, origin, (body.center_x, body.center_y), body.height)
        return self._appearance.similarity(colour_signature(lab, part, rows))

    def _search(self, rivals: NDArray[np.uint8]) -> tuple[float, float] | None:
        """Return how far from the expected place the person seems to be."""
        person, record = self.person, self.world.now
        step = max(1, round(person.height / _SEARCH_HEIGHT))
        height = person.height / step
        lab = np.ascontiguousarray(record.image.lab[::step, ::step])
        shape = (lab.shape[0], lab.shape[1])
        every = (slice(None, None, step), slice(None, None, step))
        center = (person.center_x / step, person.center_y / step)
        logit = log_ratio(
            lab,
            colour_bins(lab),
            body_rows(shape, (0, 0), center, height),
            every,
            record.background,
            person.person,
            person.surroundings,
            self.config,
        )
        likelihood = likelihood_image(logit, (slice(None), slice(None)), shape)
        likelihood[rivals[every] > 0] = 0
        silhouette = self._silhouette
        mask = np.ascontiguousarray(silhouette.mask[::step, ::step])
        place = (center[0] + silhouette.middle[0] / step, center[1] + silhouette.middle[1] / step)
        reach_x = (_REACH_X + _REACH_X_RATE * self.lost_s) * height
        reach_y = (_REACH_Y + _REACH_Y_RATE * self.lost_s) * height
        found = find_silhouette(likelihood, mask, place, (reach_x, reach_y), height)
        if found is None or found[2] < _SEARCH_SCORE:
            return None
        return step * (found[0] - place[0]), step * (found[1] - place[1])

    def result(self, likelihood: Likelihood) -> TrackResult:
        """Return what is known in the newest frame."""
        seen = self.state == TRACKED
        source = self.world.source
        return TrackResult(
            self.world.now.image.stamp_ns,
            self.track_id,
            (self.box.clipped(source[1], source[0]) or self.body) if seen else None,
            likelihood,
            self.confidence,
            self.person.angle,
            self.state,
            self.body if seen else None,
            self.features.features if seen else (),
        )

    # Feedback.

    def skip(self, record: Record) -> None:
        """Let go of a frame that is never learnt: only its motion counts."""
        if self.track_id in record.bodies and self.state == TRACKED:
            self.person.mask = _shifted(self.person.mask, *record.bodies[self.track_id])

    def learn(self, record: Record, feedback: Feedback) -> tuple[NDArray[np.uint8], Window] | None:
        """
        Learn from the mask of a frame just taken out of the world.

        Nothing is learnt from a mask that shows only part of somebody who is not at the border.

        :returns: (h, w) uint8, non-zero where the person may be, which is not to be learnt as
            background, and the window about it; None if the mask says nothing.
        """
        person, shape = self.person, self.world.shape
        mask = feedback.mask
        if mask.shape != shape:
            _, small = cv2.threshold(shrink(mask, shape), 127, 255, cv2.THRESH_BINARY)
            mask = np.asarray(small)
        prior = feedback.shape_prior
        if prior.shape != shape:
            prior = cv2.resize(prior, shape[::-1], interpolation=cv2.INTER_LINEAR)
        if self.state == LOST or not person.teaches(mask, prior) or not self._whole(mask):
            return None
        mask = self._without_world(mask, prior, record)
        dx, dy = self.world.since_mask(self.track_id)
        person.shift(-dx, -dy)
        window = person.window(shape)
        lab = record.image.lab_about(window)
        if self.config.use_feature_selection:
            view = _view(record, window)
            self.features.learn(view, mask[window], self.config.colour_rate)
        strange = record.background.contradicted(
            np.ascontiguousarray(lab[window]), window, self.config.shadow_floor
        )
        person.learn_colours(lab, mask, prior, self.config.colour_rate, strange)
        size = 2 * max(1, round(_DILATION * person.height)) + 1
        kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
        grown = _dilated(mask, kernel)
        body = None if feedback.body is None else feedback.body.scaled(self.world.scale)
        person.learn_place(mask, body)
        if self.config.use_tilt:
            person.learn_angle(mask)
        person.mask = mask
        self._learnt += 1
        if self._learnt % _LOOK_EVERY == 1:
            self._appearance.learn(self._signature(mask, record))
        if self._inside_image() > _WHOLLY:
            self._silhouette = _Silhouette.of(mask, person)
        person.shift(dx, dy)
        return grown, window

    def _without_world(
        self, mask: NDArray[np.uint8], prior: NDArray[np.uint8], record: Record
    ) -> NDArray[np.uint8]:
        """Return a mask without what is far from the template and stays while the body moves."""
        window, still = record.still.get(self.track_id, (None, None))
        if window is None or still is None:
            return mask
        size = 2 * max(1, round(_FAR_OUTSIDE * self.person.height)) + 1
        near = cv2.dilate(prior[window], np.ones((size, size), np.uint8))
        far = cv2.inRange(near, 0, 127)
        clean = mask.copy()
        clean[window] = cv2.bitwise_and(mask[window], cv2.bitwise_not(cv2.bitwise_and(still, far)))
        return clean

    def _whole(self, mask: NDArray[np.uint8]) -> bool:
        """Return whether a mask is as large as it should be, and get used to its size."""
        area = self._area_of(mask)
        share = area / max(self._area, 1e-6)
        self._area += _AREA_RATE * (area - self._area)
        return share >= _WELL

    def _area_of(self, mask: NDArray[np.uint8]) -> float:
        """Return the area of a mask in squared body heights, made up for what is outside."""
        inside = max(self._inside_image(), 0.1)
        return np.count_nonzero(mask > 127) / (inside * self.person.height**2)

    def _add_motion(self, logit: NDArray[np.float32], record: Record, window: Window) -> None:
        camera, shift = self.world.camera_motion(), self.world.body_motion(self.track_id)
        if camera is None or shift is None:
            return
        body = np.array([[1.0, 0.0, shift[0]], [0.0, 1.0, shift[1]]])
        center = np.array([self.person.center_x, self.person.center_y])
        stays = camera[:, :2] @ (center - shift) + camera[:, 2]
        if np.hypot(*(center - stays)) < _LEAST_MOTION * self.person.height:
            return
        earlier = self.world.history[0].image.gray
        moving = np.zeros(logit.shape, np.float32)
        add_motion(moving, record.image.gray, earlier, camera, body, window, 1.0)
        logit += np.float32(self.config.motion_weight) * moving
        record.still[self.track_id] = (
            window,
            (moving < _STILL).view(np.uint8) * np.uint8(255),
        )


def _ratio(part: NDArray[np.uint8], whole: NDArray[np.uint8]) -> float:
    """Return how much of a mask another has."""
    return cv2.countNonZero(part) / max(cv2.countNonZero(whole), 1)


def _dilated(mask: NDArray[np.uint8], kernel: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Dilate a mask, which is cheap because only the part about it is touched."""
    x, y, width, height = cv2.boundingRect(mask)
    margin = kernel.shape[0]
    part = (
        slice(max(y - margin, 0), y + height + margin),
        slice(max(x - margin, 0), x + width + margin),
    )
    out = np.zeros(mask.shape, np.uint8)
    out[part] = cv2.dilate(mask[part], kernel)
    return out


def _view(record: Record, window: Window) -> View:
    heat = None if record.heat is None else record.heat[window]
    return View(record.image.bgr[window], record.image.gray[window], heat=heat)


def _shifted(mask: NDArray[np.uint8], dx: float, dy: float) -> NDArray[np.uint8]:
    return shift_whole(mask, round(dx), round(dy))

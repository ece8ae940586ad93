# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One person in a world: what is known of them, and where they are expected."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.colour import ColourModel, body_rows
from gait_segmentation.geometry import Box, body_window
from gait_segmentation.images import (
    Window,
    distance_from,
    placed,
    shift_whole,
    shifted_part,
    size_of,
)
from gait_segmentation.results import LOST, TRACKED, FeatureWeight, TrackResult
from gait_segmentation.scene.world_motion import WorldMotion
from gait_segmentation.starting import FirstMask
from gait_segmentation.tracking.appearance import Appearance, colour_signature
from gait_segmentation.tracking.competition import REACH, Claim, beyond
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.cues import View
from gait_segmentation.tracking.cues.heat_map import HeatMapCue
from gait_segmentation.tracking.cues.motion import MotionCue
from gait_segmentation.tracking.likelihood import log_ratio
from gait_segmentation.tracking.person import LEAST_SEEN, WHOLE, Person
from gait_segmentation.tracking.records import Record, Shift
from gait_segmentation.tracking.visibility import ALONE, Sight, mean_shift, visible_box
from gait_segmentation.tracking.world import World

_LOST_FRAMES = 2
"""Frames in a row in which too little is seen after which a person is lost."""

_COAST_S, _STOP_S, _MOST_LOST_S = 1.0, 0.5, 1.0
"""
Time for which a hidden person is taken to walk on, in which they are then to stop, and for which
they are lost longer with a frame at most, however long that took to come.
"""


class Target:
    """
    One person in a world.

    ``seen`` is the share of the person seen last, ``lost_s`` the seconds
    since somebody lost was seen; ``whole`` is the last mask of all of the person, (h, w) uint8 of
    the working image, and where the centre of the body was then.
    """

    learns_from_masks = True
    features: tuple[FeatureWeight, ...] = ()
    """What the likelihood is made of, best first, if it is made of features."""

    def __init__(
        self,
        track_id: int,
        world: World,
        start: FirstMask,
        config: TrackingConfig,
        heat_map: HeatMapCue | None = None,
    ) -> None:
        """
        Begin with the first mask.

        :param heat_map: what is known of the heat map, if anything.
        """
        record = world.now
        self.track_id, self.world, self.config = track_id, world, config
        self.state, self.confidence = TRACKED, 0.0
        self.person = Person(
            start.body.center_x,
            start.body.center_y,
            start.body.height,
            max(start.body.center_x - start.box.x, 1.0),
            max(start.box.right - start.body.center_x, 1.0),
            start.mask,
            ColourModel(config.band_share, config.colour_floor),
            ColourModel(config.band_share, config.colour_floor),
            cues=(MotionCue(), heat_map or HeatMapCue()),
        )
        if config.use_tilt:
            self.person.tilt = self.person.angle = start.body.angle
        self.person.learn_first_colours(record.image.lab, start.votes)
        record.bodies[track_id] = (0.0, 0.0)
        self._box: Box | None = None
        self.seen, self.uncovered = 1.0, True
        self._unseen_frames, self.lost_s = 0, 0.0
        self.whole = (start.mask, self._pixel)
        self.appearance = Appearance(self.look(start.mask, record))

    @property
    def box(self) -> Box:
        """Return the box about what can be seen, in source pixels."""
        return self._box if self._box is not None else self.body

    @property
    def body(self) -> Box:
        """Return the box of the whole body in source pixels, in the frame of the body."""
        return self.person.box.scaled(1 / self.world.scale)

    @property
    def is_inside(self) -> bool:
        """Return whether the box about the body is all inside of the image."""
        box, (height, width) = self.body, self.world.source
        return box.x > 0 and box.y > 0 and box.right < width and box.bottom < height

    @property
    def feet(self) -> float:
        """Return the row of the soles in working pixels: the lower, the nearer."""
        return self.person.center_y + self.person.height / 2

    def is_near(self, other: Target) -> bool:
        """Return whether the box about another person comes near to that about this one."""
        gap = REACH * self.person.height
        return self.person.area.padded(gap, gap).iou(other.person.box) > 0

    @property
    def window(self) -> Window:
        """Return the rows and columns about the person in the working image."""
        return self.person.window(self.world.shape)

    def carried_mask(self) -> NDArray[np.uint8]:
        """Return the last mask, carried along with the body, in the window about the person."""
        if self.state == LOST:
            mask, then = self.whole
            x, y = self._pixel
            return shifted_part(mask, x - then[0], y - then[1], self.window)
        return self.world.carried(self.person.mask, self.track_id, self.window)

    def carried_part(self) -> NDArray[np.uint8]:
        """Return what of the person can be followed, as the last mask showed it, likewise."""
        return self.world.carried(self.person.part, self.track_id, self.window)

    def follow(self, motion: WorldMotion, body: NDArray[np.uint8] | None) -> None:
        """
        Follow the body into the world's newest frame.

        :param motion: of the world.
        :param body: (h, w) uint8 of the window about the person, what of the body can be followed
            from the frame before, without what others hid there; None of somebody lost.
        """
        person, seconds = self.person, self.world.step_s
        x, y = motion.carry(person.center_x, person.center_y)
        world = (x - person.center_x, y - person.center_y)
        if body is None:
            shift = self._coast(world, seconds)
        else:
            measured = self._measured(seconds, body)
            shift = person.move(world, measured, seconds)
            # A pace that was measured wrongly leads anywhere.
            back = person.keep_near(self.world.shape)
            shift = (shift[0] + back[0], shift[1] + back[1])
        self.world.now.bodies[self.track_id] = shift

    @property
    def _pixel(self) -> tuple[int, int]:
        """Return the centre of the body in whole pixels."""
        return round(self.person.center_x), round(self.person.center_y)

    def _coast(self, world: Shift, seconds: float) -> Shift:
        """
        Let somebody lost walk on unseen, ever slower, and wait at the border of the image.

        :param world: shift of the still world at the person, in working pixels.
        :returns: the shift made.
        """
        person = self.person
        # In a gap nobody was looked for.
        self.lost_s += min(seconds, _MOST_LOST_S)
        share = math.exp(-max(self.lost_s - _COAST_S, 0.0) / _STOP_S)
        dx, dy = (w + share * seconds * v for w, v in zip(world, person.velocity, strict=True))
        person.shift(dx, dy)
        x, y = person.keep_near(self.world.shape)
        return dx + x, dy + y

    def look(self, mask: NDArray[np.uint8], record: Record) -> NDArray[np.float32]:
        """Return what the person looks like in a mask of a frame, see ``colour_signature``."""
        window = self.window
        lab, rows = record.image.lab_part(window), self.person.rows(window)
        return colour_signature(lab, mask[window], rows)

    def likeness(self, start: FirstMask, record: Record) -> float:
        """Return how alike (0..1) the colours of a first mask in some frame are."""
        body, shape = start.body, start.mask.shape
        center = (body.center_x, body.center_y)
        window = body_window(*center, body.height).slices(shape[1], shape[0])
        part = start.mask[window]
        rows = body_rows(part.shape, (window[1].start, window[0].start), center, body.height)
        lab = record.image.lab_part(window)
        return self.appearance.similarity(colour_signature(lab, part, rows))

    def fade(self, chroma: float) -> None:
        """Go on as if all that is known of the colours had the same a* and b*."""
        for model in (self.person.person, self.person.surroundings, self.appearance):
            model.fade(chroma)

    def learn_look(self, record: Record) -> None:
        """Take in the person's mask, which must be of that frame."""
        mask = self.person.mask
        self.appearance.learn(self.look(mask, record))
        if self.person.share_inside(mask.shape) > ALONE:
            self.whole = (mask, self._pixel)

    def _measured(self, seconds: float, body: NDArray[np.uint8]) -> Shift | None:
        """Return how far the body went as its pixels say, None if they may be somebody else's."""
        if self.seen >= WHOLE or self.uncovered:
            return self.world.body_shift(body, self.window, self.person.way(seconds))
        return None

    def judge(self) -> Claim | None:
        """Judge the pixels in a window about the person, None if all of it is outside."""
        person, seen = self.person, self.state == TRACKED
        expected = self.carried_mask()
        window, record, config = self.window, self.world.now, self.config
        if not all(size_of(window)):
            return None
        lab = record.image.lab_part(window)
        away = distance_from(expected > 127)
        strangers = None
        if seen and person.template is not None:
            strangers = np.float32(config.stranger_density) * beyond(away, person.height)
        logit = log_ratio(
            lab,
            person.rows(window),
            window,
            record.background,
            person.person,
            person.surroundings,
            config,
            strangers,
        )
        center = (person.center_x, person.center_y)
        for cue in person.cues:
            view = View(
                self.world, self.track_id, center, person.height, window, logit, seen, config
            )
            evidence = cue.evidence(view)
            if evidence is not None:
                logit += evidence
        body = None
        if person.template is not None:
            body = self.world.carried(person.template, self.track_id, window)
        return Claim(window, logit, expected, away, self.feet, person.height, not seen, body)

    def assess(
        self, likelihood: NDArray[np.uint8], claim: Claim, cover: NDArray[np.uint8] | None
    ) -> None:
        """
        See how well the person stands out, and refine the place.

        :param likelihood: (h, w) uint8 of the working image.
        :param claim: what was made of the pixels where the person is expected.
        :param cover: (h, w) uint8 of its window, non-zero where others hide the person.
        """
        values = likelihood[claim.window]
        sight = Sight.of(values, claim.mask, cover)
        self.confidence, self.uncovered = sight.confidence, sight.share > ALONE
        if self._notice(sight.seen):
            self._refine(values, sight, claim)

    def _notice(self, seen: float) -> bool:
        """
        Take in which share of the person was seen in a frame, and give up who is not seen.

        :returns: whether there was enough to go on with.
        """
        self.seen = seen
        if seen >= LEAST_SEEN and self.person.share_inside(self.world.shape) >= LEAST_SEEN / 2:
            self._unseen_frames = 0
            return True
        self._unseen_frames += 1
        if self._unseen_frames >= _LOST_FRAMES:
            self.lose()
        return False

    def _refine(self, values: NDArray[np.uint8], sight: Sight, claim: Claim) -> None:
        """
        Refine the place by mean shift, and see where the person ends.

        :param values: (h, w) uint8 likelihood of the window of the claim.
        """
        person, window, gain = self.person, claim.window, self.config.mean_shift_gain
        if self.seen >= WHOLE:
            box = person.box.shifted(-window[1].start, -window[0].start)
            shift = mean_shift(values, sight.uncovered, box)
            self.shift_now(gain * shift.dx, gain * shift.dy)
            if len(self.world.pending) > 1:
                # The last mask is of an earlier frame: until a newer one comes, this is the size.
                person.follow_scale(shift.scale)
        self._show(values, sight, claim)

    def _show(self, values: NDArray[np.uint8], sight: Sight, claim: Claim) -> None:
        """Take the likely pixels near the mask for what can be seen of the person."""
        height = self.person.height
        box = visible_box(values, sight.uncovered, claim.away, claim.window, height)
        self._box = None if box is None else box.scaled(1 / self.world.scale)

    def shift_now(self, dx: float, dy: float) -> None:
        """Correct the place in the newest frame."""
        self.person.shift(dx, dy)
        body = self.world.now.bodies[self.track_id]
        self.world.now.bodies[self.track_id] = (body[0] + dx, body[1] + dy)

    def miss(self) -> None:
        """Take in that nothing can be seen in the newest frame."""
        self.confidence = 0.0
        if self.state == TRACKED:
            self._notice(0.0)

    def stay(self) -> None:
        """Take it that a gap follows in which the person may have done anything."""
        if self.state == TRACKED:
            self.lose()
        self.person.forget_pace()

    def lose(self) -> None:
        """Give the person up for lost."""
        self.state = LOST
        self.person.template = None
        self.lost_s = 0.0
        self._unseen_frames = 0
        self._box = None

    def regain(self, values: NDArray[np.uint8], sight: Sight, claim: Claim) -> None:
        """
        Track somebody lost again, where the expected mask is.

        :param values: (h, w) uint8 likelihood of the window of the claim.
        """
        dx, dy = self.world.since_mask(self.track_id)
        expected = placed(claim.mask, claim.window, self.world.shape)
        self.person.take(shift_whole(expected, round(-dx), round(-dy)), None)
        self.state = TRACKED
        self.seen = sight.seen
        self._show(values, sight, claim)

    def result(self, likelihood: NDArray[np.uint8]) -> TrackResult:
        """
        Return what is known in the newest frame.

        :param likelihood: (h, w) uint8 of the working image.
        """
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
            self.features if seen else (),
        )

    def skip(self, record: Record) -> None:
        """Let go of a frame that is never learnt: only its motion counts."""
        if self.state == TRACKED and self.track_id in record.bodies:
            self.person.carry(*record.bodies[self.track_id])

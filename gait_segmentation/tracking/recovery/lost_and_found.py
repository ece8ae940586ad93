# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
What is remembered of a person to find them again, and the search.

Somebody lost is taken to walk on for a while and then to wait; they are looked for where they
are expected, then all over the image.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.colour import body_rows, colour_bins
from gait_segmentation.geometry import body_window
from gait_segmentation.images import Bounds
from gait_segmentation.starting import Start
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.likelihood.log_ratio import likelihood_image, log_ratio
from gait_segmentation.tracking.person.appearance import (
    SAME_COLOURS,
    Appearance,
    colour_signature,
    likeness,
)
from gait_segmentation.tracking.person.person import Person
from gait_segmentation.tracking.records import Record
from gait_segmentation.tracking.recovery.search import find_silhouette, searched
from gait_segmentation.tracking.recovery.silhouette import Silhouette
from gait_segmentation.tracking.recovery.visibility import ALONE, Sight
from gait_segmentation.tracking.world import World

__all__ = ['Memory']


_FOUND_SHARE, _FOUND_INSIDE, _FOUND_CONTRAST = 0.3, 0.5, 0.35
"""What somebody lost must show to be found: uncovered share, likelihood, and contrast."""

_FOUND_PART = 0.12
"""
Share that somebody lost must show who is hidden by the background; and so what a search must
score, since what is hidden adds nothing.
"""

_SEARCH_HEIGHT = 32
"""Height of the body in the image that is searched, in pixels."""

_COAST_S, _STOP_S = 1.0, 0.5
"""Time for which a hidden person is taken to walk on, and in which they are then to stop."""

_REACH_X, _REACH_X_RATE = 0.5, 1.5
_REACH_Y, _REACH_Y_RATE = 0.2, 0.2
"""How far from the expected place somebody is looked for, in body heights, and per second."""

_LOOK_EVERY = 3
"""Masks of which one is looked at for what the person looks like."""


class Memory:
    """
    Colours and silhouette of a person, and how long the person has been lost.

    ``lost_s`` are the seconds since the person was seen last; ``silhouette`` is the last mask of
    all of the person.
    """

    def __init__(self, person: Person, record: Record) -> None:
        """Begin with the first mask of a person, in the frame it is of."""
        self.lost_s = 0.0
        self.silhouette = Silhouette.of(person.mask, person)
        self.appearance = Appearance()
        self._recent = _signature(person, person.mask, record)
        self.appearance.learn(self._recent)
        self._learnt = 0

    def begin_search(self) -> None:
        """Begin to count how long the person has been lost."""
        self.lost_s = 0.0

    def learn_look(self, person: Person, record: Record, bounds: Bounds | None = None) -> None:
        """Take in the person's mask, which must be of that frame, and its bounds if known."""
        self._learnt += 1
        if self._learnt % _LOOK_EVERY == 1:
            self._recent = _signature(person, person.mask, record)
            self.appearance.learn(self._recent)
        if person.share_inside(person.mask.shape) > ALONE:
            self.silhouette = Silhouette.of(person.mask, person, bounds)

    def likeness(self, start: Start, record: Record) -> float:
        """Return how alike (0..1) the colours of a first mask in some frame are."""
        body, shape = start.body, start.mask.shape
        window = body_window(body.center_x, body.center_y, body.height).slices(shape[1], shape[0])
        lab = record.image.lab_part(window)
        part = start.mask[window]
        origin = (window[1].start, window[0].start)
        rows = body_rows(part.shape, origin, (body.center_x, body.center_y), body.height)
        return self.appearance.similarity(colour_signature(lab, part, rows))

    def coast(
        self, person: Person, world: tuple[float, float], seconds: float, shape: tuple[int, int]
    ) -> tuple[float, float]:
        """
        Let the person walk on unseen, ever slower, and wait at the border of the image.

        :param world: shift of the still world at the person, in working pixels.
        :param shape: (h, w) of the working image.
        :returns: the shift made.
        """
        self.lost_s += seconds
        share = math.exp(-max(self.lost_s - _COAST_S, 0.0) / _STOP_S)
        dx = world[0] + share * seconds * person.velocity[0]
        dy = world[1] + share * seconds * person.velocity[1]
        person.shift(dx, dy)
        x, y = person.keep_near(shape)
        return dx + x, dy + y

    def is_found(
        self,
        person: Person,
        sight: Sight,
        part: Sight | None,
        likely: NDArray[np.uint8],
        now: Record,
        *,
        partly: bool = False,
    ) -> bool:
        """
        Return whether what is seen at a place is the person.

        :param part: the sight of what stands out before the known background, of somebody who
            may be beside or above something that stands there; None of somebody behind others.
        :param likely: (h, w) uint8 of the working image, above 127 on what is likely and
            uncovered.
        :param partly: whether only ``part`` counts.
        """
        stands_out = part is not None and _stands_out(part, _FOUND_PART)
        if not (stands_out or (not partly and _stands_out(sight, _FOUND_SHARE))):
            return False
        return self._is_like(_signature(person, likely, now))

    def _is_like(self, look: NDArray[np.float32]) -> bool:
        """
        Return whether colours are those of the person, as usual or as they were last.

        Somebody who has walked into other light since the track began looks more like the last
        masks than like the mean.  These count only as far as they are like the mean themselves:
        they may be of somebody else who was taken for the person.
        """
        usual = self.appearance
        if usual.similarity(look) >= SAME_COLOURS:
            return True
        if usual.similarity(self._recent) < SAME_COLOURS:
            return False
        return likeness(self._recent, look) >= SAME_COLOURS

    def search(
        self, person: Person, world: World, taken: NDArray[np.uint8], config: TrackingConfig
    ) -> tuple[float, float, bool] | None:
        """
        Look for the silhouette all over the newest frame, at low resolution.

        :param taken: (h, w) uint8, non-zero where others are.
        :returns: how far from the expected place the person seems to be, in working pixels, and
            whether only a part is seen there, if at all.
        """
        record = world.now
        step = max(1, round(person.height / _SEARCH_HEIGHT))
        height = person.height / step
        center = (person.center_x / step, person.center_y / step)
        silhouette = self.silhouette
        mask = np.ascontiguousarray(silhouette.mask[::step, ::step])
        place = (center[0] + silhouette.middle[0] / step, center[1] + silhouette.middle[1] / step)
        reach = (
            (_REACH_X + _REACH_X_RATE * self.lost_s) * height,
            (_REACH_Y + _REACH_Y_RATE * self.lost_s) * height,
        )
        rows, columns = searched(mask, place, reach, height).slices(
            -(-world.shape[1] // step), -(-world.shape[0] // step)
        )
        if rows.start >= rows.stop or columns.start >= columns.stop:
            return None
        every = (
            slice(rows.start * step, rows.stop * step, step),
            slice(columns.start * step, columns.stop * step, step),
        )
        lab = record.image.lab_part(every)
        shape = (lab.shape[0], lab.shape[1])
        origin = (columns.start, rows.start)
        logit = log_ratio(
            lab,
            colour_bins(lab),
            body_rows(shape, origin, center, height),
            every,
            record.background,
            person.person,
            person.surroundings,
            config,
        )
        likelihood = likelihood_image(logit, (slice(None), slice(None)), shape)
        likelihood[taken[every] > 0] = 0
        place = (place[0] - origin[0], place[1] - origin[1])
        found = find_silhouette(likelihood, mask, place, reach, height)
        if found is None or found[2] < _FOUND_PART:
            return None
        x, y, score = found
        return step * (x - place[0]), step * (y - place[1]), score < _FOUND_SHARE


def _stands_out(sight: Sight, least: float) -> bool:
    """Return whether at least a share is seen, likely, and more so than what is around."""
    contrast = sight.inside - sight.outside
    return sight.share >= least and sight.inside >= _FOUND_INSIDE and contrast >= _FOUND_CONTRAST


def _signature(person: Person, mask: NDArray[np.uint8], record: Record) -> NDArray[np.float32]:
    window = person.window(mask.shape)
    lab = record.image.lab_part(window)
    return colour_signature(lab, mask[window], person.rows(window))

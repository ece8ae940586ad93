# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Running the stages once before the first frame comes.

Numba compiles a kernel, or loads it from its cache, when it is first called; that takes up to
seconds and must not happen while a camera waits.  So each stage is given a short film of people
who walk before a camera that pans and then turns, in which everything happens that calls a kernel.

A node has one stage, and what the others need takes long to import: each is imported when it is
warmed up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import BodyFrame, Box
from gait_segmentation.kernel_cache import mend_kernel_cache
from gait_segmentation.results import Feedback, MatchResult

if TYPE_CHECKING:
    from gait_segmentation.gait_model import TemplateBank
    from gait_segmentation.matching import MatchingConfig
    from gait_segmentation.pipeline import PipelineConfig
    from gait_segmentation.segmentation import SegmentationConfig
    from gait_segmentation.starting import StartingConfig
    from gait_segmentation.tracking import TrackingConfig

__all__ = ['open_bank', 'warm_up', 'warm_up_matcher', 'warm_up_segmenter', 'warm_up_tracker']

_WIDTH, _HEIGHT, _BODY = 152, 112, 60
_STEP_NS = 100_000_000
"""Long steps, so that few are enough to find somebody who walks."""

_FOUND = 12
"""Frame in which a person is to have been found; else a box is given."""

_TRACKED, _TURNS = 6, 2
"""Frames from then on; in the last ones the camera turns."""

_MATCHED = 7


def open_bank(path: str) -> TemplateBank:
    """
    Return the bank of a file, the standard one for an empty path.

    :raises BankError: if it cannot be read.
    """
    from gait_segmentation.gait_model import TemplateBank, default_bank

    return TemplateBank.load(path) if path else default_bank()


def warm_up(config: PipelineConfig, bank: TemplateBank | None = None) -> None:
    """
    Call everything that a pipeline calls in its first frames.

    :param bank: the templates; the standard bank if None.
    """
    bank = bank if bank is not None else open_bank('')
    warm_up_tracker(bank, config.tracking, config.starting, config.people.max_people)
    warm_up_matcher(bank, config.matching)
    warm_up_segmenter(config.segmentation)


def warm_up_tracker(
    bank: TemplateBank,
    config: TrackingConfig,
    starting: StartingConfig | None = None,
    max_people: int = 1,
) -> None:
    """
    Call everything that the tracking stage calls in its first frames.

    :param starting: how people are found; as by default if None.
    :param max_people: number of slots; with one nobody competes.
    """
    from gait_segmentation.starting import StartingConfig
    from gait_segmentation.tracking import PeopleTracker
    from gait_segmentation.tracking.person.extent import extent_of

    mend_kernel_cache()
    starting = starting or StartingConfig()
    tracker = PeopleTracker(bank, config, max_people=min(max_people, 2), starting=starting)
    begin = _FOUND if starting.auto_init == 'none' else 0
    seen = False
    for index in range(begin, _FOUND + _TRACKED):
        scene = _Scene.at(index, _FOUND + _TRACKED - _TURNS)
        if index == _FOUND:
            given = scene.people[int(seen) : max_people]
            for person in given:
                tracker.initialize(person.box)
        tracks = tracker.update(scene.image, (index + 1) * _STEP_NS)
        feedback = []
        for track, person in zip(tracks, scene.people, strict=False):
            size = track.likelihood.shape[::-1]
            prior = np.asarray(cv2.resize(person.mask, size, interpolation=cv2.INTER_AREA))
            feedback.append(
                Feedback(track.stamp_ns, track.track_id, person.mask, person.body, prior)
            )
        seen = bool(tracks[0].track_id)
        tracker.learn([each for each in feedback if each.track_id])
    # What is looked at only of bodies that lean.
    person = scene.people[0]
    extent_of(person.mask, (person.body.center_x, person.body.center_y), 0.2)


def warm_up_matcher(bank: TemplateBank, config: MatchingConfig) -> None:
    """Call everything that the matching stage calls in its first frames."""
    from gait_segmentation.matching import SequenceMatcher

    mend_kernel_cache()
    matcher = SequenceMatcher(bank, config)
    for index in range(_MATCHED):
        person = _Scene.at(index).people[0]
        # Once the box jumps, and once something hides a part of the figure.
        known = np.where(person.mask[::-1] > 0, 0, 255).astype(np.uint8)
        matcher.update(
            person.mask,
            person.box.shifted(_BODY / 4, 0) if index == 3 else person.box,
            (index + 1) * _STEP_NS,
            track_id=1,
            source_size=(_WIDTH, _HEIGHT),
            known=known if index == 4 else None,
        )
    matcher.flush()


def warm_up_segmenter(config: SegmentationConfig) -> None:
    """Call everything that the segmentation stage calls in its first frames."""
    from gait_segmentation.segmentation import Segmenter

    mend_kernel_cache()
    segmenter = Segmenter(config)
    for index in range(_MATCHED):
        scene = _Scene.at(index)
        person = scene.people[0]
        # Half the size, so that the outline is refined at full resolution as well.
        small = np.asarray(cv2.resize(person.mask, (_WIDTH // 2, _HEIGHT // 2)))
        likelihood = cv2.blur(small, (5, 5))
        stamp = (index + 1) * _STEP_NS
        match = MatchResult(
            stamp, 1, person.body, None, 0, index, index / 20, 1.0, 0.0, 1.0, 1.0, small
        )
        segmenter.update(scene.image, likelihood, match)


@dataclass(frozen=True)
class _Walker:
    """Somebody in a frame: the mask, (H, W) uint8 0/255, and the body."""

    mask: NDArray[np.uint8]
    body: BodyFrame

    @classmethod
    def at(cls, center_x: float, phase: float) -> _Walker:
        """Draw a head, a trunk and two legs that swing."""
        mask = np.zeros((_HEIGHT, _WIDTH), np.uint8)
        x, y, unit = center_x, _HEIGHT / 2, _BODY / 80
        joint = tuple[float, float]

        def limb(one: joint, two: joint, thick: float) -> None:
            begin, end = ((round(a), round(b)) for a, b in (one, two))
            cv2.line(mask, begin, end, 255, round(thick * unit))

        cv2.circle(mask, (round(x), round(y - 33 * unit)), round(7 * unit), 255, -1)
        limb((x, y - 20 * unit), (x, y - 2 * unit), 15)
        for side in (-1, 1):
            swing = 0.45 * side * math.sin(2 * math.pi * phase)
            bend = max(0.0, 0.5 * side * math.cos(2 * math.pi * phase))
            thigh, shin = (
                19 * unit * np.array([(math.sin(a), math.cos(a)) for a in (swing, swing - bend)])
            )
            knee = (x + thigh[0], y + thigh[1])
            limb((x, y), knee, 9)
            limb(knee, (knee[0] + shin[0], knee[1] + shin[1]), 7)
        return cls(mask, BodyFrame(x, y, _BODY))

    @property
    def box(self) -> Box:
        """Return the tight box."""
        box = Box.around(self.mask)
        assert box is not None
        return box


@dataclass(frozen=True)
class _Scene:
    """An image, (H, W, 3) uint8, and who is in it."""

    image: NDArray[np.uint8]
    people: tuple[_Walker, ...]

    @classmethod
    def at(cls, index: int, turns: int = 99) -> _Scene:
        """Draw a frame: one walks to the right, once with a jump, and meets another."""
        people = (
            _Walker.at(20.0 + 4.5 * index + 8.0 * (index > 6), 0.1 * index),
            _Walker.at(205.0 - 6.0 * index, 0.1 * index),
        )
        angle = 3.0 * max(0, index - turns)
        turn = cv2.getRotationMatrix2D((_WIDTH / 2, _HEIGHT / 2), angle, 1.0)
        turn[0, 2] -= 1.7 * index
        image = _seen(_texture(60, 140), turn)
        for person, colour in zip(people, ((0, 0, 120), (120, 0, 0)), strict=True):
            worn = np.array([[1.0, 0.0, person.body.center_x - _WIDTH / 2], [0.0, 1.0, 0.0]])
            clothes = _seen(_texture(60, 110), worn) + np.array(colour, np.uint8)
            image[person.mask > 0] = clothes[person.mask > 0]
        return cls(image, people)


def _texture(darkest: int, lightest: int) -> NDArray[np.uint8]:
    """Return cells of different colours, so coarse that their motion can be measured."""
    cells = np.random.default_rng(0).integers(darkest, lightest, (16, 32, 3)).astype(np.uint8)
    return np.asarray(cv2.resize(cells, (256, 128), interpolation=cv2.INTER_CUBIC))


def _seen(texture: NDArray[np.uint8], motion: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Return an image of a texture that has moved."""
    size, border = (_WIDTH, _HEIGHT), cv2.BORDER_REFLECT
    return np.asarray(cv2.warpAffine(texture, motion, size, borderMode=border))

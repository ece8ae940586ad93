# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
One segmenter for each slot, and their masks put together.

Where people overlap they are cut out from the nearest to the farthest, and what one has got the
next cannot have: each pixel has one owner.  Nearer is who has the lower feet.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import InputError
from gait_segmentation.geometry import BodyFrame, Box, check_body
from gait_segmentation.images import check_image, check_map, same_proportions
from gait_segmentation.people import Crew
from gait_segmentation.results import MatchResult, SegmentationResult
from gait_segmentation.segmentation.config import SegmentationConfig
from gait_segmentation.segmentation.segmenter import Segmenter


@dataclass(frozen=True)
class PeopleMasks:
    """
    The silhouettes of all people in one frame.

    ``people`` has one result a slot.  ``mask`` is (H, W) uint8 0/255, their union; ``labels`` is
    (H, W) uint8, 0 or slot + 1.  No pixel belongs to two people.
    """

    people: tuple[SegmentationResult, ...]
    mask: NDArray[np.uint8]
    labels: NDArray[np.uint8]


class PeopleSegmenter:
    """Cuts several people out of frame after frame."""

    def __init__(
        self, config: SegmentationConfig | None = None, *, max_people: int = 1, threads: int = 1
    ) -> None:
        """
        Make a segmenter for each slot.

        :param max_people: number of slots.
        :param threads: how many work at a time.
        """
        config = config or SegmentationConfig()
        self._slots = [Segmenter(config) for _ in range(max_people)]
        self._crew = Crew(threads)

    @property
    def config(self) -> SegmentationConfig:
        """Return the configuration in force; it may be exchanged between frames."""
        return self._slots[0].config

    @config.setter
    def config(self, config: SegmentationConfig) -> None:
        for slot in self._slots:
            slot.config = config

    def reset(self) -> None:
        """Forget everybody."""
        for slot in self._slots:
            slot.reset()

    def update(
        self,
        image: NDArray[np.uint8],
        likelihoods: Sequence[NDArray[np.uint8]],
        matches: Sequence[MatchResult],
        *,
        outside: bool = False,
    ) -> PeopleMasks:
        """
        Segment one frame.

        :param image: (H, W, 3) uint8 BGR, the source frame with the stamp of the matches.
        :param likelihoods: (h, w) uint8, the foreground likelihood image of each slot.
        :param matches: the matched template of each slot.
        :param outside: whether the likelihoods come from outside, not from the tracker.
        :raises InputError: if shapes or types do not fit, or a body makes no sense.
        """
        check_image(image)
        if not len(likelihoods) == len(matches) == len(self._slots):
            raise InputError(
                f'there must be {len(self._slots)} likelihoods and matches, one a slot, got '
                f'{len(likelihoods)} and {len(matches)}'
            )
        for likelihood, match in zip(likelihoods, matches, strict=True):
            # Before anybody's state is changed.
            _check_sizes(image, likelihood, match.shape_prior)
            if match.body is not None:
                check_body(match.body, (image.shape[1], image.shape[0]))
        tasks = [
            partial(self._cut_out, group, image, likelihoods, matches, outside=outside)
            for group in _groups(matches)
        ]
        found = {slot: each for part in self._crew.run(tasks) for slot, each in part.items()}
        people = tuple(found[slot] for slot in range(len(self._slots)))
        if len(people) == 1:
            mask = people[0].mask
            return PeopleMasks(people, mask, mask & np.uint8(1))
        labels = np.zeros(image.shape[:2], np.uint8)
        for slot, each in enumerate(people):
            labels[each.mask > 0] = slot + 1
        return PeopleMasks(people, np.where(labels > 0, np.uint8(255), np.uint8(0)), labels)

    def _cut_out(
        self,
        group: Sequence[int],
        image: NDArray[np.uint8],
        likelihoods: Sequence[NDArray[np.uint8]],
        matches: Sequence[MatchResult],
        *,
        outside: bool,
    ) -> dict[int, SegmentationResult]:
        """Cut out slots one after the other; what those before have got is taken."""
        found: dict[int, SegmentationResult] = {}
        for slot in group:
            masks = [each.mask for other, each in found.items() if _touch(matches, slot, other)]
            taken = functools.reduce(np.bitwise_or, masks) if masks else None
            found[slot] = self._slots[slot].update(
                image, likelihoods[slot], matches[slot], taken, outside=outside
            )
        return found


def _check_sizes(
    image: NDArray[np.uint8], likelihood: NDArray[np.uint8], prior: NDArray[np.uint8]
) -> None:
    """
    Refuse a likelihood and a shape prior that do not fit the image or each other.

    :param image: (H, W, 3) uint8.
    :param likelihood: (h, w) uint8, of its proportions and no larger.
    :param prior: (h, w) uint8.
    :raises InputError: if shapes or types do not fit.
    """
    for name, array in (('likelihood', likelihood), ('shape prior', prior)):
        check_map(array, name)
    if likelihood.shape != prior.shape:
        raise InputError(
            f'likelihood and shape prior must have the same size, got {likelihood.shape} '
            f'and {prior.shape}'
        )
    smaller = all(
        size <= whole for size, whole in zip(likelihood.shape, image.shape[:2], strict=True)
    )
    if not smaller or not same_proportions(likelihood.shape, image.shape[:2]):
        raise InputError(
            f'likelihood must have the proportions of the image {image.shape[:2]} and be no '
            f'larger, got {likelihood.shape}'
        )


def _groups(matches: Sequence[MatchResult]) -> list[list[int]]:
    """Return the slots in groups that do not touch each other, in each the nearest first."""

    def feet(slot: int) -> float:
        body = matches[slot].body
        if body is None:
            return -math.inf
        return body.center_y + 0.5 * body.height * math.cos(body.angle)

    order = sorted(range(len(matches)), key=feet, reverse=True)
    groups: list[list[int]] = []
    for slot in order:
        touching = [group for group in groups if any(_touch(matches, slot, k) for k in group)]
        joined = [each for each in order if any(each in group for group in touching)]
        groups = [group for group in groups if group not in touching]
        groups.append([*joined, slot])
    return groups


def _touch(matches: Sequence[MatchResult], one: int, two: int) -> bool:
    first, second = matches[one].body, matches[two].body
    return first is not None and second is not None and _reach(first).iou(_reach(second)) > 0


def _reach(body: BodyFrame) -> Box:
    """Return the box that a person's mask may fill."""
    return Box.from_center(body.center_x, body.center_y, 1.4 * body.height, 1.4 * body.height)

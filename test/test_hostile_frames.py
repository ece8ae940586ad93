# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Odd frames, boxes, maps, settings and stamps through the three stages: nothing ends them.

Only what is documented to be refused may be refused, nothing may warn, and every frame has one
result of the right shape, type and range.
"""

from __future__ import annotations

import math
from dataclasses import fields, replace
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given, strategies as st

from gait_segmentation.config import StageConfig, parameters_of
from gait_segmentation.errors import ConfigError, InputError
from gait_segmentation.gait_model import default_bank
from gait_segmentation.geometry import BodyFrame, Box, check_start_box
from gait_segmentation.matching import MatchingConfig
from gait_segmentation.people import PeopleConfig
from gait_segmentation.pipeline import FrameResult, Pipeline, PipelineConfig
from gait_segmentation.results import EMPTY
from gait_segmentation.segmentation import SegmentationConfig
from gait_segmentation.stamps import Order, Stamps
from gait_segmentation.starting import StartingConfig
from gait_segmentation.tracking import TrackingConfig
from test.hostile import examples
from test.walkers import box_of, clip, small_bank

DEAR = {'working_height': 200, 'shifts_x': 8, 'shifts_y': 8, 'scales': 3, 'lag': 8}
"""Largest values of what costs much time and leads nowhere else."""

SIDES = st.integers(60, 240)
SHAPES = st.one_of(
    *[st.tuples(SIDES, SIDES)] * 5,
    st.tuples(st.integers(16, 48), st.integers(16, 48)),
    st.tuples(st.integers(16, 64), st.integers(200, 2000)),
    st.tuples(st.integers(200, 2000), st.integers(16, 64)),
)
PICTURES = st.sampled_from((*['walk'] * 5, 'last', 'dark', 'bright', 'flat', 'noise'))
STEPS_S = st.sampled_from((*[1 / 25] * 5, 1 / 10, 1e-9, 1.0, 3.0, 1e4, 0.0, -0.5, -5.0))


def changed(draw: Any, config: StageConfig) -> Any:
    """Return a configuration with other values, the same if they contradict each other."""
    given = {}
    for about in draw(st.lists(st.sampled_from(parameters_of(config)), max_size=4, unique=True)):
        if about.choices is not None or about.type is bool:
            given[about.name] = draw(st.sampled_from(about.choices or (False, True)))
        elif about.minimum is not None and about.maximum is not None:
            most = min(about.maximum, DEAR.get(about.name, math.inf))
            numbers = st.integers if about.type is int else st.floats
            given[about.name] = draw(numbers(about.minimum, most))
    try:
        return replace(config, **given)
    except ConfigError:
        return config


def picture(draw: Any, number: int, last: np.ndarray) -> tuple[np.ndarray, Box | None]:
    """Return a picture of a size, and the box of who walks there."""
    kind, (rows, columns) = draw(PICTURES), last.shape[:2]
    if kind == 'last':
        return last, None
    if kind == 'flat':
        return np.full_like(last, draw(st.sampled_from((0, 1, 127, 255)))), None
    if kind == 'noise':
        return np.random.default_rng(number).integers(0, 256, last.shape, np.uint8), None
    frame = clip()[number % 16]
    box, (height, width) = box_of(frame), frame.image.shape[:2]
    down, right = rows / height, columns / width
    there = Box(box.x * right, box.y * down, box.width * right, box.height * down)
    image = cv2.resize(frame.image, (columns, rows))
    return cv2.convertScaleAbs(image, alpha={'dark': 0.3, 'bright': 2.0}.get(kind, 1.0)), there


def heat(draw: Any, shape: tuple[int, ...]) -> np.ndarray:
    """Return a map: nothing, all or noise."""
    kind = draw(st.sampled_from((0, 255, 'noise')))
    noise = np.random.default_rng(1).integers(0, 256, shape, np.uint8)
    return noise if isinstance(kind, str) else np.full(shape, kind, np.uint8)


def boxes(shape: tuple[int, ...], known: Box | None) -> st.SearchStrategy[Box]:
    """Draw boxes: of somebody, all, tiny, partly or wholly out, or far too large."""
    height, width = shape[:2]
    edges = [st.floats(-0.5 * side, 1.1 * side) for side in (width, height)]
    sides = [st.floats(1e-3, reach * side) for reach in (1, 5) for side in (width, height)]
    anywhere = st.builds(Box, *edges, *sides[:2]) | st.builds(Box, *edges, *sides[2:])
    return anywhere | st.sampled_from(
        [known or Box(0, 0, width, height), Box(0, 0, width, height)]
    )


def refused(box: Box, shape: tuple[int, ...]) -> bool:
    """Return whether a box is one that is documented to be refused."""
    try:
        check_start_box(box, (shape[1], shape[0]))
    except InputError:
        return True
    return False


def check(result: FrameResult, shape: tuple[int, ...], slots: int) -> None:
    """Check what must hold of every result."""
    labels, mask = result.labels, result.mask
    assert labels.shape == mask.shape == shape
    assert labels.dtype == mask.dtype == np.uint8
    assert np.array_equal(mask, np.where(labels > 0, 255, 0))
    assert labels.max() <= slots == len(result.people)
    ids = [person.track.track_id for person in result.people if person.track.track_id]
    assert len(set(ids)) == len(ids)
    for slot, person in enumerate(result.people):
        track, match, found = person.track, person.match, person.segmentation
        assert result.stamp_ns == track.stamp_ns == match.stamp_ns == found.stamp_ns
        assert track.track_id == match.track_id == found.track_id
        assert (track.state == EMPTY) == (track.track_id == 0)
        assert match.shape_prior.shape == track.likelihood.shape
        assert match.shape_prior.dtype == track.likelihood.dtype == np.uint8
        assert np.array_equal(found.mask > 0, labels == slot + 1)
        assert found.mask.any() == (found.reason == '')
        shares = [track.confidence, match.confidence, match.similarity, match.phase]
        assert all(0 <= value <= 1 for value in shares)
        assert match.phase < 1
        others = [track.angle, match.azimuth, match.phase_rate]
        others += [
            value for each in track.features for value in (each.variance_ratio, each.weight)
        ]
        others += [getattr(match.body, f.name) for f in fields(BodyFrame)] if match.body else []
        assert all(map(math.isfinite, others))


# Of a tiny person all is too far away for a float, which is capped.
@pytest.mark.filterwarnings('ignore:overflow encountered in multiply')
@examples(30, 150)
@given(data=st.data())
def test_every_frame_has_one_sound_result(data: Any) -> None:
    draw = data.draw
    kinds = (TrackingConfig, MatchingConfig, SegmentationConfig, StartingConfig)
    tracking, matching, segmentation, starting = (changed(draw, k()) for k in kinds)
    people = PeopleConfig(draw(st.integers(1, 4)), draw(st.integers(1, 2)))
    config = PipelineConfig(tracking, matching, segmentation, people, starting)
    pipe = Pipeline(config, small_bank() if draw(st.booleans()) else default_bank())
    image, stamps = np.zeros((*draw(SHAPES), 3), np.uint8), Stamps()
    waiting: list[tuple[int, tuple[int, ...]]] = []
    pending: list[Box] = []

    def take(results: list[FrameResult]) -> None:
        for result in results:
            stamp_ns, shape = waiting.pop(0)
            assert result.stamp_ns == stamp_ns
            check(result, shape, people.max_people)
            # What is returned may be written to.
            result.mask[:] = result.labels[:] = 7

    for number in range(draw(st.integers(2, 10))):
        event = draw(st.integers(0, 12))
        if event == 12:
            pipe.reset()
            waiting, pending, stamps = [], [], Stamps()
        elif event == 11:
            image = np.zeros((*draw(SHAPES), 3), np.uint8)
        image, known = picture(draw, number, image)
        outside = heat(draw, image.shape[:2]) if event == 9 else None
        seen = heat(draw, draw(SHAPES)) if event == 8 else None
        given_boxes = draw(st.lists(boxes(image.shape, known), max_size=3)) if event < 3 else []
        stamp_ns = max(stamps.newest_ns + round(1e9 * draw(STEPS_S)), 1)
        pending += given_boxes
        for box in given_boxes:
            pipe.initialize(box)
        order = stamps.order(stamp_ns)
        bad = sum(refused(box, image.shape) for box in pending)
        while True:
            try:
                results = pipe.update(image.copy(), stamp_ns, outside, seen)
                break
            except InputError:
                # As documented: one box at a time.
                bad -= 1
                assert bad >= 0
        if order is Order.STALE:
            assert results == []
            continue
        assert bad == 0
        pending = []
        if stamps.take(stamp_ns) is Order.RESET:
            waiting.clear()
        waiting.append((stamp_ns, image.shape[:2]))
        take(results)
    take(pipe.flush())
    assert not waiting

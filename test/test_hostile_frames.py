# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Odd frames, boxes, maps, settings and stamps through the three stages: nothing ends them."""

from __future__ import annotations

import math
from dataclasses import asdict, replace
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given, strategies as st

from gait_segmentation.config import StageConfig, parameters_of
from gait_segmentation.errors import ConfigError, InputError
from gait_segmentation.geometry import Box, check_start_box
from gait_segmentation.people import PeopleConfig
from gait_segmentation.pipeline import FrameResult, Pipeline, PipelineConfig
from gait_segmentation.results import EMPTY
from gait_segmentation.stamps import Order, Stamps
from test.hostile import examples
from test.walkers import clip, small_bank

DEAR = {'working_height': 200, 'shifts_x': 8, 'shifts_y': 8, 'scales': 3, 'lag': 8}
"""Largest values of what costs much time and leads nowhere else."""

SIDES, FEW, MANY = st.integers(60, 240), st.integers(16, 64), st.integers(200, 2000)
SHAPES = st.one_of(
    *[st.tuples(SIDES, SIDES)] * 5, *map(st.tuples, (FEW, FEW, MANY), (FEW, MANY, FEW))
)
PICTURES = st.sampled_from((*['walk'] * 5, 'last', 'dark', 'bright', 'noise', 0, 127, 255))
STEPS_S = st.sampled_from((*[1 / 25] * 5, 1 / 10, 2e-4, 1.0, 3.0, 1e4, 0.0, -0.5, -5.0))


def changed(draw: Any, config: StageConfig) -> Any:
    """Return a configuration with other values, the same if they contradict each other."""
    values = {}
    for about in draw(st.lists(st.sampled_from(parameters_of(config)), max_size=4, unique=True)):
        if about.choices is not None or about.type is bool:
            values[about.name] = draw(st.sampled_from(about.choices or (False, True)))
        elif about.minimum is not None and about.maximum is not None:
            most = min(about.maximum, DEAR.get(about.name, math.inf))
            numbers = st.integers if about.type is int else st.floats
            values[about.name] = draw(numbers(about.minimum, most))
    try:
        return replace(config, **values)
    except ConfigError:
        return config


def picture(kind: object, number: int, last: np.ndarray) -> np.ndarray:
    """Return a picture of the size of the last one."""
    if kind == 'last':
        return last.copy()
    if kind == 'noise':
        return np.random.default_rng(number).integers(0, 256, last.shape, np.uint8)
    if isinstance(kind, int):
        return np.full_like(last, kind)
    image = cv2.resize(clip()[number % 16].image, last.shape[1::-1])
    return cv2.convertScaleAbs(image, alpha={'dark': 0.3, 'bright': 2.0}.get(str(kind), 1.0))


def boxes(shape: tuple[int, ...]) -> st.SearchStrategy[Box]:
    """Draw boxes: of who walks, tiny, partly or wholly out, or far too large."""
    edges = [st.floats(-0.5 * side, 1.1 * side) for side in shape[1::-1]]
    sides = [st.floats(1e-3, 5 * side) for side in shape[1::-1]]
    known, down, right = clip()[0].boxes[0], shape[0] / 240, shape[1] / 320
    assert known is not None
    there = Box(known.x * right, known.y * down, known.width * right, known.height * down)
    return st.builds(Box, *edges, *sides) | st.just(there)


def refused(box: Box, shape: tuple[int, ...]) -> bool:
    """Return whether a box is one that is documented to be refused."""
    try:
        check_start_box(box, (shape[1], shape[0]))
    except InputError:
        return True
    return False


def check(result: FrameResult, shape: tuple[int, ...]) -> None:
    """Check what must hold of every result."""
    labels, mask = result.labels, result.mask
    assert labels.shape == mask.shape == shape
    assert labels.dtype == mask.dtype == np.uint8
    assert np.array_equal(mask, np.where(labels > 0, 255, 0))
    assert labels.max() <= len(result.people)
    ids = [person.track.track_id for person in result.people if person.track.track_id]
    assert len(set(ids)) == len(ids)
    for slot, person in enumerate(result.people):
        track, match, found = person.track, person.match, person.segmentation
        assert result.stamp_ns == track.stamp_ns == match.stamp_ns == found.stamp_ns
        assert track.track_id == match.track_id == found.track_id
        assert (track.state == EMPTY) == (track.track_id == 0)
        assert match.shape_prior.shape == track.likelihood.shape
        assert np.array_equal(found.mask > 0, labels == slot + 1)
        assert found.mask.any() == (found.reason == '')
        shares = [track.confidence, match.confidence, match.similarity, match.phase]
        assert all(0 <= value <= 1 for value in shares)
        others = [track.angle, match.azimuth, match.phase_rate]
        others += asdict(match.body).values() if match.body else []
        assert all(map(math.isfinite, others))


# Of a tiny person all is too far away for a float, which is capped.
@pytest.mark.filterwarnings('ignore:overflow encountered in multiply')
@examples(30, 150)
@given(data=st.data())
def test_every_frame_has_one_sound_result(data: Any) -> None:
    draw, config = data.draw, PipelineConfig()
    names = ('tracking', 'matching', 'segmentation', 'starting')
    config = replace(config, **{name: changed(draw, getattr(config, name)) for name in names})
    people = PeopleConfig(draw(st.integers(1, 4)))
    pipe = Pipeline(replace(config, people=people), small_bank())
    image, stamps = np.zeros((*draw(SHAPES), 3), np.uint8), Stamps()
    waiting: list[tuple[int, tuple[int, ...]]] = []
    pending: list[Box] = []

    def take(results: list[FrameResult]) -> None:
        for result in results:
            stamp_ns, shape = waiting.pop(0)
            assert (result.stamp_ns, len(result.people)) == (stamp_ns, people.max_people)
            check(result, shape)
            # What is returned may be written to.
            result.mask[:] = result.labels[:] = 7

    for number in range(draw(st.integers(2, 10))):
        event = draw(st.integers(0, 12))
        if event == 12:
            pipe.reset()
            waiting, pending, stamps = [], [], Stamps()
        elif event == 11:
            image = np.zeros((*draw(SHAPES), 3), np.uint8)
        image = picture(draw(PICTURES), number, image)
        heat = None
        if event == 10:
            drawn = picture(draw(PICTURES), number, np.zeros((*draw(SHAPES), 3), np.uint8))
            heat = np.ascontiguousarray(drawn[..., 0])
        for box in draw(st.lists(boxes(image.shape), max_size=3)) if event < 3 else ():
            pipe.initialize(box)
            pending.append(box)
        stamp_ns = max(stamps.newest_ns + round(1e9 * draw(STEPS_S)), 1)
        stale = stamps.order(stamp_ns) is Order.STALE
        results, bad = None, sum(refused(box, image.shape) for box in pending)
        while results is None:
            try:
                results = pipe.update(image.copy(), stamp_ns, heat)
            except InputError:
                # As documented: one box at a time.
                bad -= 1
                assert bad >= 0
        if stale:
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

#!/usr/bin/env python3
# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Random sequences through the three stages: nothing that a camera may show ends them.

Sizes, pictures (flat, saturated, noise, gradients, repeated, walkers, cuts, black ones between),
boxes, heat maps, likelihoods from outside, settings and stamps are drawn by hypothesis, which
makes a sequence that fails as simple as it can.  Only what is documented to be refused may be
refused, nothing may warn, and what comes out is checked.  With NUMBA_BOUNDSCHECK=1 and a
NUMBA_CACHE_DIR of its own, kernels look at every index, too.
"""

from __future__ import annotations

import math
import sys
import warnings
from collections import deque
from collections.abc import Callable
from dataclasses import fields, replace
from functools import cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.fuzzing import fuzz
from benchmarks.synthetic import SyntheticConfig, SyntheticSequence
from gait_segmentation.cli.tool import run_tool
from gait_segmentation.config import Parameter, StageConfig, parameters_of
from gait_segmentation.errors import ConfigError, InputError
from gait_segmentation.gait_model import TemplateBank, default_bank
from gait_segmentation.geometry import BodyFrame, Box, check_matched_box, check_start_box
from gait_segmentation.kernels import compile_kernels
from gait_segmentation.matching import MatchingConfig, PeopleMatcher
from gait_segmentation.people import PeopleConfig
from gait_segmentation.pipeline import FrameResult, Pipeline, PipelineConfig
from gait_segmentation.results import EMPTY, MatchResult, SegmentationResult, TrackResult
from gait_segmentation.segmentation import PeopleSegmenter, SegmentationConfig
from gait_segmentation.stamps import Order, Stamps
from gait_segmentation.starting import StartingConfig
from gait_segmentation.tracking import TrackingConfig
from gait_tools.gait_model import BankSpec, build_bank

Image = NDArray[np.uint8]
Shape = tuple[int, int]

WALK = 50
"""Frames in which somebody walks past, at 25 frames/s."""

DEAR = {'working_height': 200, 'shifts_x': 8, 'shifts_y': 8, 'scales': 3, 'lag': 8}
"""Largest values of what costs much time and leads nowhere else."""

LARGE = 4e5
"""Pixels from which sequences are short."""

BANKS = (
    BankSpec(azimuths=8, phases=12),
    BankSpec(azimuths=2, phases=4, height=32, width=24),
    None,
)
USUAL = st.tuples(st.integers(60, 240), st.integers(60, 320))
THIN = st.tuples(st.integers(16, 64), st.integers(200, 2000))
SHAPES = st.one_of(
    *[USUAL] * 5,
    st.tuples(st.integers(16, 48), st.integers(16, 48)),
    THIN,
    THIN.map(lambda sides: sides[::-1]),
    st.tuples(st.integers(400, 1200), st.integers(400, 1200)),
)
PICTURES = ('walk', 'walk', 'walk', 'walk', 'walk', 'last', 'dark', 'bright', 'flat', 'noise',
            'slope', 'texture')  # fmt: skip
SECONDS = st.sampled_from([1 / 25] * 5 + [1 / 10, 1e-9, 1.0, 3.0, 1e4])
SEEDS = st.integers(0, 2**32 - 1)


def values(about: Parameter) -> st.SearchStrategy[Any]:
    """Draw values of a parameter."""
    if about.choices is not None:
        return st.sampled_from(about.choices)
    if about.type is bool:
        return st.booleans()
    if about.type is str or about.minimum is None or about.maximum is None:
        return st.just(about.default)
    most = min(about.maximum, DEAR.get(about.name, math.inf))
    if about.type is int:
        return st.integers(math.ceil(about.minimum), math.floor(most))
    return st.floats(about.minimum, most)


def changed(draw: Callable[..., Any], config: Any, *, live: bool = True) -> Any:
    """
    Return a configuration with some other values, the same if they contradict each other.

    :param live: whether only what may change while a node runs does.
    """
    abouts = [each for each in parameters_of(config) if not (live and each.read_only)]
    some = draw(st.lists(st.sampled_from(abouts), max_size=6, unique=True))
    try:
        return replace(config, **{about.name: draw(values(about)) for about in some})
    except ConfigError:
        return config


def drawn_config(draw: Callable[..., Any]) -> PipelineConfig:
    """Return a configuration of all stages."""
    kinds: tuple[type[StageConfig], ...] = (TrackingConfig, MatchingConfig, SegmentationConfig)
    tracking, matching, segmentation = (changed(draw, kind(), live=False) for kind in kinds)
    people = PeopleConfig(draw(st.integers(1, 4)), draw(st.integers(1, 2)))
    starting = changed(draw, StartingConfig(), live=False)
    return PipelineConfig(tracking, matching, segmentation, people, starting)


@cache
def bank(spec: BankSpec | None) -> TemplateBank:
    return default_bank() if spec is None else build_bank(spec)


@cache
def walk(number: int) -> tuple[list[Image], list[list[Box]]]:
    """Return the frames and boxes of one to three people who walk past."""
    config = SyntheticConfig(number, 160, 120, frames=WALK, person_height=60.0, walkers=1 + number)
    frames = list(SyntheticSequence(config))
    boxes = [[box for box in frame.boxes if box is not None] for frame in frames]
    return [frame.image for frame in frames], boxes


class Film:
    """Pictures of one size."""

    def __init__(self, draw: Callable[..., Any], shape: Shape, *, calm: bool = False) -> None:
        """
        Draw the people.

        :param calm: whether they walk past where nothing else happens, so that they are found.
        """
        self.shape, self.boxes = shape, list[Box]()
        self._draw, self._calm = draw, calm
        self._walk = draw(st.integers(0, 2))
        self._rng = np.random.default_rng(draw(SEEDS))
        self._last = np.zeros((*shape, 3), np.uint8)

    def picture(self, number: int) -> Image:
        """Return a picture; ``boxes`` are then those of the people in it."""
        kind = 'walk' if self._calm else self._draw(st.sampled_from(PICTURES))
        self._last = np.ascontiguousarray(self._made(kind, number))
        return self._last.copy()

    def _made(self, kind: str, number: int) -> Image:
        rng, (rows, columns) = self._rng, self.shape
        if kind == 'last':
            return self._last
        if kind == 'flat':
            return np.full(
                (rows, columns, 3), self._draw(st.sampled_from((0, 1, 127, 255))), np.uint8
            )
        if kind == 'noise':
            return rng.integers(0, 256, (rows, columns, 3), np.uint8)
        if kind == 'slope':
            slope = np.linspace(0, self._draw(st.sampled_from((1, 255, 1000))), columns) % 256
            return np.broadcast_to(slope[:, None].astype(np.uint8), (rows, columns, 3))
        if kind == 'texture':
            cells = rng.integers(40, 220, (rows // 12 + 2, columns // 12 + 2, 3), np.uint8)
            return cv2.resize(cells, (columns, rows), interpolation=cv2.INTER_CUBIC)
        images, boxes = walk(self._walk)
        image, found = images[number % WALK], boxes[number % WALK]
        down, right = rows / image.shape[0], columns / image.shape[1]
        self.boxes = [
            Box(b.x * right, b.y * down, b.width * right, b.height * down) for b in found
        ]
        gain = {'dark': 0.3, 'bright': 2.0}.get(kind, 1.0)
        return cv2.convertScaleAbs(cv2.resize(image, (columns, rows)), alpha=gain)

    def box(self) -> Box:
        """Return a box: of somebody, all, tiny, partly out, anywhere, or far too large."""
        height, width = self.shape
        edges = [st.floats(-0.5 * side, 1.1 * side) for side in (width, height)]
        sides = [st.floats(1e-3, reach * side) for reach in (1, 5) for side in (width, height)]
        anywhere = st.builds(Box, *edges, *sides[:2]) | st.builds(Box, *edges, *sides[2:])
        known = st.sampled_from(self.boxes) if self.boxes else anywhere
        return self._draw(known | anywhere | st.just(Box(0, 0, width, height)))

    def map(self, shape: Shape | None = None) -> Image:
        """Return a map of one value a pixel: nothing, all, noise, or blobs."""
        share = self._draw(st.sampled_from((1.0, 0.6, 0.1)))
        rows, columns = shape or (max(1, round(side * share)) for side in self.shape)
        kind = self._draw(st.sampled_from(('none', 'all', 'noise', 'blobs')))
        if kind in ('none', 'all'):
            return np.full((rows, columns), 255 * (kind == 'all'), np.uint8)
        noise = self._rng.integers(0, 256, (rows, columns), np.uint8)
        if kind == 'noise':
            return noise
        soft = cv2.GaussianBlur(noise.astype(np.float32), (0, 0), 0.1 * min(self.shape))
        return cv2.convertScaleAbs(soft - 127, alpha=20)


class Player:
    """Plays a random sequence through a pipeline."""

    def __init__(self, draw: Callable[..., Any]) -> None:
        self.draw = draw
        self.config = drawn_config(draw)
        self.pipe = Pipeline(self.config, bank(draw(st.sampled_from(BANKS))))
        self._forget()

    def _forget(self) -> None:
        self.waiting: deque[tuple[int, Shape]] = deque()
        self.boxes: list[Box] = []
        self.stamps = Stamps()

    def play(self) -> None:
        """Play it, and the results that a lag holds back."""
        draw = self.draw
        calm = draw(st.integers(0, 4)) == 4
        film = Film(draw, draw(USUAL if calm else SHAPES), calm=calm)
        large = film.shape[0] * film.shape[1] > LARGE
        for number in range(WALK if calm else 4 if large else draw(st.integers(2, 13))):
            event = draw(st.integers(0, 300 if calm else 30))
            if event == 1:
                self.pipe.reset()
                self._forget()
            elif event == 2 and not large:
                film = Film(draw, draw(USUAL), calm=calm)
            elif event == 3:
                self._exchange()
            self._frame(film, number, calm)
        self._take(self.pipe.flush())
        assert not self.waiting, f'{len(self.waiting)} frames have no result'

    def _frame(self, film: Film, number: int, calm: bool) -> None:
        draw, image = self.draw, film.picture(number)
        seconds = 1 / 25 if calm else draw(SECONDS)
        stamp_ns = self.stamps.newest_ns + max(1, round(1e9 * seconds))
        event = draw(st.integers(0, 400 if calm else 40))
        if event == 1 and self.stamps.newest_ns:
            stamp_ns = self.stamps.newest_ns
        elif event == 2 and self.stamps.newest_ns > 1:
            stamp_ns = draw(st.integers(1, self.stamps.newest_ns))
        elif event == 3 and self.stamps.newest_ns == 0:
            # As of a clock that counts from 1970.
            stamp_ns += 1_700_000_000 * 10**9
        elif event < 8 or (number == 0 and event % 2):
            self.boxes += [film.box() for _ in range(draw(st.integers(1, 3)))]
            for box in self.boxes:
                self.pipe.initialize(box)
        outside = film.map() if event == 9 else None
        heat = film.map(draw(THIN)) if event in (10, 11) else None
        if self.stamps.order(stamp_ns) is Order.STALE:
            assert self.pipe.update(image, stamp_ns, None, heat) == [], 'a stale frame is answered'
            return
        results = None
        while results is None:
            bad = [box for box in self.boxes if refused(check_start_box, box, film.shape)]
            try:
                results = self.pipe.update(image, stamp_ns, outside, heat)
            except InputError:
                # As documented: one box at a time.
                if not bad:
                    raise
                self.boxes.remove(bad[0])
            else:
                assert not bad, f'{bad[0]} should have been refused'
        self.boxes = []
        if self.stamps.take(stamp_ns) is Order.RESET:
            self.waiting.clear()
        self.waiting.append((stamp_ns, film.shape))
        image[:] = 77
        self._take(results)

    def _take(self, results: list[FrameResult]) -> None:
        for result in results:
            stamp_ns, shape = self.waiting.popleft()
            assert result.stamp_ns == stamp_ns, 'every frame once, in order'
            check_frame(result, shape, self.config.people.max_people)
            # What is returned may be written to.
            result.mask[:] = result.labels[:] = 7
            for person in result.people:
                person.track.likelihood[:] = person.match.shape_prior[:] = 200

    def _exchange(self) -> None:
        """Exchange a configuration, as the nodes do when a parameter is set."""
        pipe = self.pipe
        owners = (pipe.tracker, 'config'), (pipe.tracker, 'starting'), (pipe.segmenter, 'config')
        owner, name = self.draw(st.sampled_from((*owners, (pipe.matcher, 'config'))))
        if owner is pipe.matcher:
            self._take(pipe.flush())
        setattr(owner, name, changed(self.draw, getattr(owner, name)))


def refused(check: Callable[[Box, Shape], None], box: Box, shape: Shape) -> bool:
    """Tell whether a box is one that is documented to be refused."""
    try:
        check(box, shape[::-1])
    except InputError:
        return True
    return False


def play_outside(draw: Callable[..., Any]) -> None:
    """Play likelihoods and boxes of another tracker through matcher and segmenter."""
    config, shape = drawn_config(draw), draw(SHAPES)
    slots = config.people.max_people
    matcher = PeopleMatcher(bank(draw(st.sampled_from(BANKS))), config.matching, max_people=slots)
    segmenter = PeopleSegmenter(config.segmentation, max_people=slots)
    film = Film(draw, shape)
    held: dict[int, tuple[Image, list[TrackResult]]] = {}
    stamp_ns = 0
    for number in range(draw(st.integers(1, 7))):
        image = film.picture(number)
        stamp_ns += draw(st.integers(1, 10**8))
        tracks = []
        for slot in range(slots):
            box = film.box() if draw(st.integers(0, 4)) else None
            if box is not None and refused(check_matched_box, box, shape):
                box = None
            track_id = slot + 1 if box is not None else 0
            angle = draw(st.floats(-4, 4))
            tracks.append(TrackResult(stamp_ns, track_id, box, film.map(), 0.5, angle))
        held[stamp_ns] = image, tracks
        found = matcher.update(tracks, source_size=shape[::-1])
        found += matcher.flush() if draw(st.integers(0, 9)) == 9 else []
        for matches in found:
            image, tracks = held.pop(matches[0].stamp_ns)
            likelihoods = [track.likelihood for track in tracks]
            masks = segmenter.update(image, likelihoods, matches, external=True)
            for track, match, mask in zip(tracks, matches, masks.people, strict=True):
                check_person(track, match, mask, shape)


def check_person(
    track: TrackResult, match: MatchResult, found: SegmentationResult, shape: Shape
) -> None:
    """Check what must hold of each person."""
    assert track.stamp_ns == match.stamp_ns == found.stamp_ns, 'one frame'
    assert track.track_id == match.track_id == found.track_id, 'one person'
    assert (track.state == EMPTY) == (track.track_id == 0), 'state'
    assert (track.likelihood.dtype, track.likelihood.ndim) == (np.uint8, 2), 'likelihood'
    assert match.shape_prior.shape == track.likelihood.shape, 'shape prior'
    assert match.shape_prior.dtype == np.uint8, 'shape prior'
    assert (found.mask.shape, found.mask.dtype) == (shape, np.uint8), 'mask'
    assert bool(found.mask.any()) == (found.reason == ''), f'reason {found.reason!r}'
    numbers = [track.confidence, match.confidence, match.similarity, match.phase]
    assert all(0 <= value <= 1 for value in numbers), f'0 to 1: {numbers}'
    assert match.phase < 1, 'phase'
    others = [track.angle, match.azimuth, match.phase_rate]
    others += [value for each in track.features for value in (each.variance_ratio, each.weight)]
    others += [getattr(match.body, each.name) for each in fields(BodyFrame)] if match.body else []
    assert all(map(math.isfinite, others)), f'finite: {others}'


def check_frame(result: FrameResult, image_shape: Shape, slots: int) -> None:
    """Check what must hold of a frame's result."""
    assert len(result.people) == slots, 'one result a slot'
    labels, mask = result.labels, result.mask
    assert labels.shape == mask.shape == image_shape, 'size'
    assert labels.dtype == mask.dtype == np.uint8, 'type'
    assert np.isin(np.unique(mask), (0, 255)).all(), '0 or 255'
    assert labels.max() <= slots, 'labels'
    assert ((labels > 0) == (mask > 0)).all(), 'labels'
    for slot, person in enumerate(result.people):
        check_person(person.track, person.match, person.segmentation, image_shape)
        assert ((person.segmentation.mask > 0) == (labels == slot + 1)).all(), 'owners'
    ids = [person.track.track_id for person in result.people if person.track.track_id]
    assert len(set(ids)) == len(ids), 'track ids'


def play(data: st.DataObject) -> None:
    """Play a sequence."""
    cv2.setNumThreads(1)
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        if data.draw(st.integers(0, 9)) == 9:
            play_outside(data.draw)
        else:
            Player(data.draw).play()


def main() -> int:
    return fuzz(play, compile_kernels, __doc__ or '')


if __name__ == '__main__':
    sys.exit(run_tool('fuzz_pipeline.py', main))

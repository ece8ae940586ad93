#!/usr/bin/env python3
# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Random sequences through the three stages: nothing that a camera may show ends them.

Each sequence is drawn from a seed: sizes, pictures (flat, saturated, noise, gradients, repeated,
walkers, cuts, black ones between), boxes, heat maps, likelihoods from outside, settings and
stamps.  Only what is documented to be refused may be refused, nothing may warn, and what comes
out is checked.  Usage::

    python benchmarks/fuzz_pipeline.py [--sequences 2000] [--minutes M] [--seed S] [--processes N]

Sequence number n has the seed S + n, and ``--seed S --sequences 1`` plays it alone.  With
NUMBA_BOUNDSCHECK=1 and a NUMBA_CACHE_DIR of its own, kernels look at every index, too.
"""

from __future__ import annotations

import argparse
import faulthandler
import math
import multiprocessing
import signal
import sys
import time
import traceback
import warnings
from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from tqdm import tqdm

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from by_lot.checks import check_frame, check_person
from by_lot.pictures import Film, Image, Rng, box_by_lot, map_by_lot, reduced, shape_by_lot
from by_lot.settings import bank_by_lot, changed_by_lot, config_by_lot

from gait_segmentation.cli.tool import run_tool
from gait_segmentation.errors import InputError
from gait_segmentation.geometry import Box, check_matched_box, check_start_box
from gait_segmentation.kernels import compile_kernels
from gait_segmentation.matching import PeopleMatcher
from gait_segmentation.pipeline import FrameResult, Pipeline
from gait_segmentation.results import TrackResult
from gait_segmentation.segmentation import PeopleSegmenter

LARGE = 4e5
"""Pixels from which sequences are short."""

LONGEST_S = 600
"""Time after which a sequence counts as one that never ends."""


class Played(NamedTuple):
    """What became of the sequence of a seed; ``error`` is empty, or says what went wrong."""

    seed: int
    seconds: float
    error: str


class Player:
    """Plays a random sequence through a pipeline."""

    def __init__(self, rng: Rng) -> None:
        self.rng = rng
        self.config = config_by_lot(rng)
        self.pipe = Pipeline(self.config, bank_by_lot(rng))
        self._forget()

    def _forget(self) -> None:
        self.waiting: deque[tuple[int, tuple[int, int]]] = deque()
        self.boxes: list[Box] = []
        self.stamp_ns = 0

    def play(self) -> None:
        """Play it, and the results that a lag holds back."""
        rng = self.rng
        if rng.random() < 0.2:
            # Somebody walks past, for long enough to be found.
            period = float(rng.choice([1 / 10, 1 / 15, 1 / 25]))
            shape = int(rng.integers(90, 201)), int(rng.integers(160, 321))
            film, count = Film(rng, shape, rng.uniform(0.7, 1.1) * period), round(2 / period)
        else:
            shape = shape_by_lot(rng)
            large = shape[0] * shape[1] > LARGE
            period = float(rng.choice([1 / 10, 1 / 25, rng.uniform(0.001, 1)]))
            film, count = Film(rng, shape), 4 if large else int(rng.integers(2, 14))
        for number in range(count):
            chance = rng.random() * (10 if film.pace else 1)
            if chance < 0.02:
                self.pipe.reset()
                self._forget()
            elif chance < 0.04 and film.shape[0] * film.shape[1] < LARGE:
                film = Film(rng, shape_by_lot(rng))
            elif chance < 0.06:
                self._exchange()
            self._frame(film, number, period)
        self._take(self.pipe.flush())
        assert not self.waiting, f'{len(self.waiting)} frames have no result'

    def _frame(self, film: Film, number: int, period: float) -> None:
        rng, image = self.rng, film.picture(number)
        calm = 10 if film.pace else 1
        longer = float(rng.choice([1e-9, 30, 1e5])) if rng.random() * calm < 0.1 else 1.0
        stamp_ns = self.stamp_ns + max(1, round(1e9 * period * longer))
        if self.stamp_ns == 0 and rng.random() < 0.5:
            # As of a clock that counts from 1970.
            stamp_ns += 1_700_000_000 * 10**9
        chance = calm * rng.random()
        if chance < 0.02:
            stamp_ns = self.stamp_ns
        elif chance < 0.04 and self.stamp_ns > 1:
            stamp_ns = int(rng.integers(1, self.stamp_ns))
        while calm * rng.random() < (0.5 if number == 0 else 0.06):
            self.boxes.append(box_by_lot(rng, film.shape, film.boxes))
            self.pipe.initialize(self.boxes[-1])
        outside = map_by_lot(rng, reduced(rng, film.shape)) if rng.random() < 0.05 else None
        sides = int(rng.integers(1, 99)), int(rng.integers(1, 99))
        heat = map_by_lot(rng, sides) if rng.random() < 0.1 else None
        results = None
        while results is None:
            bad = [box for box in self.boxes if refused(check_start_box, box, film.shape)]
            try:
                results = self.pipe.update(image, stamp_ns, outside, heat)
            except InputError:
                # As documented: a frame without a new stamp, or one box at a time.
                if stamp_ns == self.stamp_ns:
                    return
                if not bad:
                    raise
                self.boxes.remove(bad[0])
            else:
                assert not bad, f'{bad[0]} should have been refused'
                assert stamp_ns != self.stamp_ns, 'a stamp twice should have been refused'
        self.boxes = []
        if stamp_ns < self.stamp_ns:
            self.waiting.clear()
        self.stamp_ns = stamp_ns
        self.waiting.append((stamp_ns, film.shape))
        image[:] = 77
        self._take(results)

    def _take(self, results: list[FrameResult]) -> None:
        for result in results:
            stamp_ns, shape = self.waiting.popleft()
            assert result.stamp_ns == stamp_ns, 'every frame once, in order'
            check_frame(result, shape, self.config.people.max_people)
            if self.rng.random() < 0.1:
                # What is returned may be written to.
                result.mask[:] = result.labels[:] = 7
                for person in result.people:
                    person.track.likelihood[:] = person.match.shape_prior[:] = 200

    def _exchange(self) -> None:
        """Exchange a configuration, as the nodes do when a parameter is set."""
        rng, stage = self.rng, int(self.rng.integers(4))
        if stage == 0:
            self.pipe.tracker.config = changed_by_lot(rng, self.pipe.tracker.config)
        elif stage == 1:
            self.pipe.tracker.starting = changed_by_lot(rng, self.pipe.tracker.starting)
        elif stage == 2:
            self.pipe.segmenter.config = changed_by_lot(rng, self.pipe.segmenter.config)
        else:
            self._take(self.pipe.flush())
            self.pipe.matcher.config = changed_by_lot(rng, self.pipe.matcher.config)


def refused(
    check: Callable[[Box, tuple[int, int]], None], box: Box, shape: tuple[int, int]
) -> bool:
    """Tell whether a box is one that is documented to be refused."""
    try:
        check(box, shape[::-1])
    except InputError:
        return True
    return False


def play_outside(rng: Rng) -> None:
    """Play likelihoods and boxes of another tracker through matcher and segmenter."""
    config, shape = config_by_lot(rng), shape_by_lot(rng)
    slots = config.people.max_people
    matcher = PeopleMatcher(bank_by_lot(rng), config.matching, max_people=slots)
    segmenter = PeopleSegmenter(config.segmentation, max_people=slots)
    film = Film(rng, shape)
    held: dict[int, tuple[Image, list[TrackResult]]] = {}
    stamp_ns = 0
    for number in range(int(rng.integers(1, 8))):
        image = film.picture(number)
        stamp_ns += int(rng.integers(1, 10**8))
        tracks = []
        for slot in range(slots):
            likelihood = map_by_lot(rng, reduced(rng, shape))
            box = box_by_lot(rng, shape, film.boxes) if rng.random() < 0.8 else None
            if box is not None and refused(check_matched_box, box, shape):
                box = None
            angle = float(rng.choice([0.0, rng.uniform(-4, 4)]))
            track_id = slot + 1 if box is not None else 0
            tracks.append(TrackResult(stamp_ns, track_id, box, likelihood, 0.5, angle))
        held[stamp_ns] = image, tracks
        found = matcher.update(tracks, source_size=shape[::-1])
        found += matcher.flush() if rng.random() < 0.1 else []
        for matches in found:
            image, tracks = held.pop(matches[0].stamp_ns)
            likelihoods = [track.likelihood for track in tracks]
            masks = segmenter.update(image, likelihoods, matches, outside=True)
            people = zip(tracks, matches, masks.people, strict=True)
            for track, match, mask in people:
                check_person(track, match, mask, shape)


def play(seed: int) -> Played:
    """Play the sequence of a seed."""
    cv2.setNumThreads(1)
    # Ends the process if a sequence never ends.
    faulthandler.dump_traceback_later(LONGEST_S, exit=True)
    began, rng, error = time.monotonic(), np.random.default_rng(seed), ''
    try:
        with warnings.catch_warnings():
            warnings.simplefilter('error')
            if rng.random() < 0.1:
                play_outside(rng)
            else:
                Player(rng).play()
    except Exception:
        error = traceback.format_exc()
    faulthandler.cancel_dump_traceback_later()
    return Played(seed, time.monotonic() - began, error)


def play_all(seeds: Iterable[int], total: int, until: float, processes: int) -> list[Played]:
    """Play sequences on several processors until a time, and tell of failures at once."""
    left, played = iter(seeds), []
    under_way: dict[Future[Played], int] = {}
    context = multiprocessing.get_context('spawn')
    with (
        ProcessPoolExecutor(processes, context, compile_kernels) as pool,
        tqdm(total=total, disable=None, leave=False) as bar,
    ):
        while True:
            while len(under_way) < 2 * processes and time.monotonic() < until:
                seed = next(left, None)
                if seed is None:
                    break
                under_way[pool.submit(play, seed)] = seed
            if not under_way:
                return played
            for done in wait(under_way, return_when=FIRST_COMPLETED).done:
                try:
                    played.append(done.result())
                except BrokenProcessPool:
                    seeds_of = ', '.join(map(str, sorted(under_way.values())))
                    raise SystemExit(
                        f'a process died, or did not end in {LONGEST_S} s, in one of the seeds '
                        f'{seeds_of}'
                    ) from None
                del under_way[done]
                bar.update()
                if played[-1].error:
                    bar.write(f'seed {played[-1].seed}: {played[-1].error}', file=sys.stdout)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('--sequences', type=int, default=2000, metavar='N')
    parser.add_argument('--minutes', type=float, default=math.inf, help='begin none after that')
    parser.add_argument('--seed', type=int, default=0, help='of the first sequence')
    parser.add_argument('--processes', type=int, default=2)
    options = parser.parse_args()
    # As Ctrl-C does, it ends the other processes, too.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    seeds = range(options.seed, options.seed + options.sequences)
    until = time.monotonic() + 60 * options.minutes
    played = play_all(seeds, len(seeds), until, options.processes)
    failed = sorted(each.seed for each in played if each.error)
    if played:
        slowest = max(played, key=lambda each: each.seconds)
        print(
            f'{len(played)} sequences from seed {options.seed}, {len(failed)} failed'
            f'{": " * bool(failed)}{", ".join(map(str, failed))}; the slowest took '
            f'{slowest.seconds:.1f} s (seed {slowest.seed})'
        )
    return int(bool(failed))


if __name__ == '__main__':
    sys.exit(run_tool('fuzz_pipeline.py', main))

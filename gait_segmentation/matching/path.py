# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The best sequence of templates and placements over a sliding window of frames.

The steps of the search, forward and back, are in whole numbers of 16 bits throughout.  Their loops
over placements run over different, contiguous arrays and do nothing but 16-bit arithmetic, so that
the vector unit treats 16 or 32 placements at a time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.kernels import kernel
from gait_segmentation.matching.common_areas import UNIT
from gait_segmentation.matching.config import MatchingConfig
from gait_segmentation.matching.placements import SearchRange

FLOOR = -12000
"""
Worst score relative to the best: nearly six times a similarity of 1.  Twice of it and what any
transition costs below it, also a wall, still fit 16 bits.
"""
_WALL = -FLOOR  # cost of coming from beyond the border: whatever pays it falls to the floor
# Score of body heights there are not: at the floor, also where the best score is negative.
_NOWHERE = 2 * FLOOR
WIDEST_TURN = math.radians(46.0)
"""Views farther apart are no neighbours, and have nothing between them."""
_MOST_FRAMES = 64  # frames of a path, however many a second there are

State = tuple[int, int, int, int, int]
"""Sequence, phase, scale, row and column."""

# Steps to the states before and after a state, by axis.
_SIDES = np.stack([-np.eye(5, dtype=np.int64), np.eye(5, dtype=np.int64)])


class Views:
    """The sequences of each build in the order of their azimuths: a ring, anticlockwise."""

    def __init__(self, bank: TemplateBank) -> None:
        self.azimuths = bank.azimuth.astype(np.float64)
        self.rings: dict[str, NDArray[np.int64]] = {}
        for build in dict.fromkeys(bank.builds):
            views = np.array([k for k, name in enumerate(bank.builds) if name == build])
            self.rings[build] = views[np.argsort(self.azimuths[views], kind='stable')]
        self.beside: dict[int, tuple[int, int]] = {}
        """The neighbouring views of the same build, clockwise and anticlockwise."""

        for ring in self.rings.values():
            sides = zip(np.roll(ring, 1).tolist(), np.roll(ring, -1).tolist(), strict=True)
            self.beside.update(zip(ring.tolist(), sides, strict=True))

    def azimuth(self, sequence: int, offset: float) -> float:
        """Return the azimuth ``offset`` views beside a sequence, in radians in [-pi, pi]."""
        own = float(self.azimuths[sequence])
        other = float(self.azimuths[self.beside[sequence][offset > 0]])
        gap = abs(math.remainder(other - own, 2 * math.pi))
        return math.remainder(own if gap > WIDEST_TURN else own + offset * gap, 2 * math.pi)


@dataclass(frozen=True)
class PathFrame:
    """
    A frame of the search, in path units.

    ``rows`` is (V, P * N) int16, of each sequence phase by phase the scores of the N lanes of
    ``searched`` with filling.  Placements that were not searched are at the floor.  ``costs`` are
    (D,) int16, those of advancing to the frame by 0, 1, ... D - 1 phases; D is at most P.
    """

    rows: NDArray[np.int16]
    searched: SearchRange
    seconds: float
    costs: NDArray[np.int16]

    @cached_property
    def places(self) -> NDArray[np.int16]:
        """Return the same scores without filling, (V, P, scales, rows, columns)."""
        searched, views = self.searched, len(self.rows)
        scores = self.rows.reshape(views, -1, searched.pitch)[..., : searched.size]
        return scores.reshape(*scores.shape[:2], *searched.shape)


class PathSearch:
    """
    Viterbi search over sequence, phase and placement, exact on whole numbers.

    A *sequence* of the bank is one build seen from one direction; kernels call it a view.

    Scores fade with the time constant ``memory`` and are kept relative to the best one, so that
    they stay bounded however long the search runs.  After Wang, Yagi and Makihara, ACCV 2009,
    section 3 (the sequence of templates that fits best under dynamic time warping); fading,
    views and placement moves are this package's.
    """

    def __init__(self, bank: TemplateBank, row: NDArray[np.int32], config: MatchingConfig) -> None:
        """Begin a path; ``row`` (K,) int32 is where the similarities of a template are."""
        self._config = config
        self._row = row
        self._views = Views(bank)
        self._near, self._near_cost = view_changes(bank, config)
        self._move_cost = round(UNIT * config.move_cost)
        self.leading: NDArray[np.int16] = np.zeros((bank.sequences, bank.phases), np.int16)
        """(V, P) int16, the best score of each template in the newest frame."""

        self.frames: list[PathFrame] = []
        """Those in the window, the oldest first."""

        self._best, self._owed = 0, 0.0
        self.rate = self._config.middle_rate
        """Strides per second with which the path is expected to go on."""

        self._followed: tuple[int, int] | None = None
        self.leader: State = (0, 0, 0, 0, 0)
        """The state of the newest frame to trace back from."""

        self._traced = np.empty((0, 5), np.int64)

    def step(self, similarity: NDArray[np.int16], seconds: float, searched: SearchRange) -> None:
        """
        Take in a frame.

        :param similarity: (R, N) int16, of the template of each row at each placement searched.
        :param seconds: its time, later than the last frame's.
        :param searched: the placements searched.
        """
        config, (views, phases) = self._config, self.leading.shape
        rows = np.empty((views, phases * searched.pitch), np.int16)
        before, passed = rows[:0], 0.0
        if self.frames:
            last = self.frames[-1]
            before, old, passed = last.rows, last.searched, seconds - last.seconds
            if old != searched:
                before, lanes = np.empty_like(rows), (old.pitch, searched.pitch)
                shift = np.subtract(searched.first, old.first)
                shifted(last.rows, before, phases, old.shape, searched.shape, lanes, shift)
        # What rounding leaves is owed to the next step, or all would go too slow or too fast.
        owed = self._owed + phases * self.rate * passed
        expected = round(owed)
        self._owed = owed - expected
        # Of advancing by 0, 1, 2, ... phases: standing still is allowed, going back is not.
        most = min(max(math.ceil(phases * config.fastest_rate * passed - 1e-9), 1), phases - 1)
        off = (abs(steps - min(expected, most)) / phases for steps in range(most + 1))
        costs = np.array(
            [min(round(UNIT * config.rate_cost * each), UNIT) for each in off], np.int16
        )
        fading = min(int(32768 * math.exp(-passed / config.memory)), 32767)
        advance(
            before,
            rows,
            np.int16(self._best),
            np.int16(fading),
            costs,
            self._near,
            self._near_cost,
            np.int16(self._move_cost),
            searched.shape,
            similarity,
            self._row,
            self.leading,
        )
        frames = self.frames
        while frames and (
            len(frames) == max(config.lag + 2, _MOST_FRAMES)
            or (len(frames) > config.lag + 1 and seconds - frames[1].seconds > config.window)
        ):
            del frames[0]
            self._traced = self._traced[1:]
        frames.append(PathFrame(rows, searched, seconds, costs))
        self._best = int(self.leading.max())
        sequence, phase = self._leading_template()
        lane = int(frames[-1].places[sequence, phase].argmax())
        self.leader = sequence, phase, *searched.place(lane)

    def follow(self) -> NDArray[np.int64]:
        """Trace the path back from the leader: its states, (N, 5) int64, the oldest first."""
        states = np.empty((len(self.frames), 5), np.int64)
        states[-1] = self.leader
        for index in range(len(states) - 1, 0, -1):
            if index < len(self._traced) and (states[index] == self._traced[index]).all():
                # Where it meets the path traced before, they are the same.
                states[:index] = self._traced[:index]
                break
            last = self.frames[index - 1]
            step_back(
                last.rows,
                self.frames[index].costs,
                last.searched.first,
                last.searched.shape,
                last.searched.pitch,
                self.leading.shape[1],
                self._near,
                self._near_cost,
                self._move_cost,
                states[index],
                states[index - 1],
            )
        self._traced = states
        seconds = np.array([frame.seconds for frame in self.frames])
        if seconds[-1] - seconds[0] >= 0.5:
            # The slope of the phase over time, which of less is not trusted.
            count, time = self.leading.shape[1], seconds - seconds.mean()
            strides = np.concatenate([[0], np.cumsum(np.diff(states[:, 1]) % count)]) / count
            rate = float(time @ strides / (time @ time))
            self.rate = min(max(rate, self._config.slowest_rate), self._config.fastest_rate)
        self._followed = self.leader[:2]
        return states

    def beside(self, state: State, back: int) -> tuple[float, list[float]]:
        """
        Return where beside a state, ``back`` frames ago, the best place lies.

        Along each axis by itself, it is the vertex of the parabola through three scores.

        :returns: the azimuth, in radians, and of phase, scale, row and column how many steps,
            -0.5 to 0.5, it is beside the state's.
        """
        frame, sequence = self.frames[-1 - back], state[0]
        here = np.array(state) - (0, 0, *frame.searched.first)
        sides = here + _SIDES
        sides[:, 0, 0] = self._views.beside[sequence]
        sides[:, 1, 1] %= frame.places.shape[1]
        inside = np.all((sides >= 0) & (sides < frame.places.shape), axis=2, keepdims=True)
        scores = frame.places[tuple(np.where(inside, sides, here).transpose(2, 0, 1))]
        low, high = np.where(inside[..., 0], scores.astype(np.int64), FLOOR)
        bend = 2 * int(frame.places[tuple(here)]) - low - high
        # What is at the floor has not been searched.
        curved = (np.minimum(low, high) > FLOOR) & (bend > 0)
        vertex = 0.5 * (high - low) / np.maximum(bend, 1)
        view, *offsets = np.where(curved, vertex, 0.0).clip(-0.5, 0.5).tolist()
        return self._views.azimuth(sequence, view), offsets

    def _leading_template(self) -> tuple[int, int]:
        """Return sequence and phase of the leader."""
        # The path followed is left only by a margin: equally good twins are not to alternate.
        phases = self.leading.shape[1]
        best = divmod(int(self.leading.argmax()), phases)
        if self._followed is None or len(self.frames) < 2:
            return best
        view, phase = self._followed
        passed = self.frames[-1].seconds - self.frames[-2].seconds
        expected = phase + phases * self.rate * passed
        away = np.abs((np.arange(phases) - expected + phases / 2) % phases - phases / 2)
        family = [view, *self._near[view][self._near[view] >= 0].tolist()]
        alike = np.full(self.leading.shape, np.iinfo(np.int16).min, np.int16)
        alike[family] = np.where(away < phases / 4, self.leading[family], alike[family])
        kept = divmod(int(alike.argmax()), phases)
        lead = int(self.leading[best]) - int(self.leading[kept])
        return kept if lead < UNIT * self._config.switch_margin else best


def view_changes(
    bank: TemplateBank, config: MatchingConfig
) -> tuple[NDArray[np.int32], NDArray[np.int16]]:
    """
    Return from which other sequences each can be reached in one frame, and at what costs.

    :returns: (V, M) int32 sequences, -1 where there are fewer, and (V, M) int16 costs.
    """
    views = Views(bank)
    found = []
    for sequence, (azimuth, build) in enumerate(zip(bank.azimuth, bank.builds, strict=True)):
        reached = dict.fromkeys(views.beside[sequence], config.view_cost)
        for other, (direction, name) in enumerate(zip(bank.azimuth, bank.builds, strict=True)):
            away = math.remainder(float(direction) - float(azimuth), 2 * math.pi)
            if name != build and abs(away) < 1e-3:
                reached[other] = config.build_cost
        reached.pop(sequence, None)
        found.append(sorted(reached.items()))
    most = max(len(reached) for reached in found)
    sequences = np.full((len(found), most), -1, np.int32)
    costs = np.zeros((len(found), most), np.int16)
    for index, pairs in enumerate(found):
        for place, (other, cost) in enumerate(pairs):
            sequences[index, place] = other
            costs[index, place] = min(round(UNIT * cost), UNIT)
    return sequences, costs


@kernel(
    'i2[:,::1], i2[:,::1], i2, i2, i2[::1], i4[:,::1], i2[:,::1], i2, '
    'UniTuple(i8, 3), i2[:,::1], i4[::1], i2[:,::1]'
)
def advance(  # type: ignore[no-untyped-def]
    old, new, best, fading, phase_cost, near, near_cost, move_cost, shape, similarity, row, leading
):
    """
    Compute the scores of a frame, ``new``, from those of the frame before, at the same placements.

    score = fading / 32768 * max over predecessors (score before - cost of the transition) +
    similarity, with the maximum taken axis by axis, which is exact because the costs add up.

    :param old: scores of the frame before, without rows if there was none; ``best`` of all.
    :param shape: (S, rows, columns) of the placements.
    :param similarity: (R, N), of which ``row`` (V * P,) is that of each template.
    :param leading: (V, P), largest score of each template, result.
    """
    views, phases, lanes = len(new), leading.shape[1], similarity.shape[1]
    level = shape[1] * shape[2]
    used = shape[0] * level
    started = len(old) > 0
    walls = _walls(shape, lanes, move_cost)
    reached = np.empty((views, lanes), np.int16)
    # Neighbouring placements of the first and last are read from a margin.
    size = lanes + 2 * level
    start, across, along = (
        np.empty(size, np.int16),
        np.empty(size, np.int16),
        np.empty(size, np.int16),
    )
    start[:], across[:], along[:] = FLOOR, FLOOR, _NOWHERE
    inner = slice(level, level + lanes)
    for phase in range(phases):
        if started:
            for view in range(views):
                _earlier_phases(old[view], phases, phase, phase_cost, reached[view])
        for view in range(views):
            result = new[view, phase * lanes : (phase + 1) * lanes]
            gain = similarity[row[view * phases + phase]]
            if started:
                _copy(reached[view], start[inner])
                for m in range(near.shape[1]):
                    other = near[view, m]
                    if other >= 0:
                        _other_view(reached[other], near_cost[view, m], start[inner])
                _either_side(start, level, 1, walls[0], walls[1], across)
                _either_side(across, level, shape[2], walls[2], walls[3], along)
                # The last body height would take the filling for one more.
                along[level + used : level + lanes] = _NOWHERE
                _fade(along, level, move_cost, best, fading, gain, result)
            else:
                _copy(gain, result)
            result[used:] = FLOOR
            leading[view, phase] = _largest(result)


@kernel()
def _walls(shape, lanes, move_cost):  # type: ignore[no-untyped-def]
    """Return the costs of coming from the left, right, above and below, (4, N) int16."""
    scales, rows, columns = shape
    walls = np.empty((4, lanes), np.int16)
    walls[:] = move_cost
    for scale in range(scales):
        first = scale * rows * columns
        for row in range(rows):
            walls[0, first + row * columns] = _WALL
            walls[1, first + (row + 1) * columns - 1] = _WALL
        for column in range(columns):
            walls[2, first + column] = _WALL
            walls[3, first + (rows - 1) * columns + column] = _WALL
    return walls


@kernel()
def _copy(source, result):  # type: ignore[no-untyped-def]
    for j in range(len(result)):
        result[j] = source[j]


@kernel()
def _earlier_phases(before, phases, phase, phase_cost, reached):  # type: ignore[no-untyped-def]
    """Let states of a phase, (N,), come from this phase and those before it."""
    lanes = len(reached)
    before = before[: phases * lanes].reshape(phases, lanes)
    same, stay = before[phase], phase_cost[0]
    one = min(1, len(phase_cost) - 1)
    last, step = before[(phase - one) % phases], phase_cost[one]
    for j in range(lanes):
        reached[j] = max(np.int16(same[j] - stay), np.int16(last[j] - step))
    for back in range(2, len(phase_cost)):
        older, cost = before[(phase - back) % phases], phase_cost[back]
        for j in range(lanes):
            reached[j] = max(reached[j], np.int16(older[j] - cost))


@kernel()
def _other_view(other, cost, result):  # type: ignore[no-untyped-def]
    """Let states come from another view."""
    for j in range(len(result)):
        result[j] = max(result[j], np.int16(other[j] - cost))


@kernel()
def _either_side(row, first, offset, low_cost, high_cost, result):  # type: ignore[no-untyped-def]
    """Let placements come from ``offset`` before or after."""
    size = len(low_cost)
    here, there = row[first : first + size], result[first : first + size]
    low, high = row[first - offset : first - offset + size], row[first + offset :]
    for j in range(size):
        side = max(np.int16(low[j] - low_cost[j]), np.int16(high[j] - high_cost[j]))
        there[j] = max(here[j], side)


@kernel()
def _fade(row, level, move_cost, best, fading, gain, result):  # type: ignore[no-untyped-def]
    """Let placements come from the next body heights, and make new scores of the old ones."""
    size = len(result)
    here, low, high = row[level : level + size], row[:size], row[2 * level :]
    for j in range(size):
        side = np.int16(max(low[j], high[j]) - move_cost)
        value = max(np.int16(max(here[j], side) - best), np.int16(FLOOR))
        twice = np.int16(value + value)
        faded = np.int16((np.int32(twice) * np.int32(fading)) >> np.int32(16))
        result[j] = np.int16(faded + gain[j])


@kernel()
def _largest(scores):  # type: ignore[no-untyped-def]
    largest = scores[0]
    for j in range(len(scores)):
        largest = max(largest, scores[j])
    return largest


@kernel('i2[:,::1], i2[:,::1], i8, UniTuple(i8, 3), UniTuple(i8, 3), UniTuple(i8, 2), i8[::1]')
def shifted(before, after, phases, old, new, lanes, shift):  # type: ignore[no-untyped-def]
    """
    Take the score ``after`` of each placement from ``before``, of placement + shift.

    :param old: (S, rows, columns) of the placements searched before, and ``new`` of those to be.
    :param lanes: numbers of the former and of the latter with filling.
    """
    low, high = np.empty(3, np.int64), np.empty(3, np.int64)
    for axis in range(3):
        low[axis] = max(-shift[axis], 0)
        high[axis] = min(old[axis] - shift[axis], new[axis])
    for row in range(len(before)):
        for phase in range(phases):
            source = before[row, phase * lanes[0] : (phase + 1) * lanes[0]]
            target = after[row, phase * lanes[1] : (phase + 1) * lanes[1]]
            target[:] = FLOOR
            for scale in range(low[0], high[0]):
                for line in range(low[1], high[1]):
                    here = (scale * new[1] + line) * new[2]
                    come = ((scale + shift[0]) * old[1] + line + shift[1]) * old[2] + shift[2]
                    for column in range(low[2], high[2]):
                        target[here + column] = source[come + column]


@kernel(
    'i2[:,::1], i2[::1], UniTuple(i8, 3), UniTuple(i8, 3), i8, i8, i4[:,::1], '
    'i2[:,::1], i8, i8[::1], i8[::1]'
)
def step_back(  # type: ignore[no-untyped-def]
    scores, phase_cost, first, shape, lanes, phases, near, near_cost, move_cost, state, result
):
    """
    Put the best predecessor of a state into ``result``, by the scores of the frame before.

    :param first: body height, row and column of the first placement searched then, and
        ``shape`` how many of each; ``lanes`` their number with filling.
    """
    scales, rows, columns = shape
    view, phase = state[0], state[1]
    here = state[2] - first[0], state[3] - first[1], state[4] - first[2]
    largest = np.int64(-(1 << 40))
    for option in range(near.shape[1] + 1):
        from_view = view if option == 0 else np.int64(near[view, option - 1])
        if from_view < 0:
            continue
        turn = np.int64(0) if option == 0 else np.int64(near_cost[view, option - 1])
        for step in range(len(phase_cost)):
            from_phase = (phase - step) % phases
            known = turn + phase_cost[step]
            for move in range(27):
                # Order of the 27 moves: no move first, so that ties stay in place.
                code = (move + 13) % 27
                ds, dy, dx = code // 9 - 1, code // 3 % 3 - 1, code % 3 - 1
                scale, row, column = here[0] + ds, here[1] + dy, here[2] + dx
                if not (0 <= scale < scales and 0 <= row < rows and 0 <= column < columns):
                    continue
                lane = (scale * rows + row) * columns + column
                moved = move_cost * (abs(ds) + abs(dy) + abs(dx))
                score = np.int64(scores[from_view, from_phase * lanes + lane])
                value = score - known - moved
                if value > largest:
                    largest = value
                    result[0], result[1] = from_view, from_phase
                    result[2], result[3], result[4] = scale, row, column
    if largest == -(1 << 40):
        # Not searched before: the nearest placement takes over.
        least = 0
        for step in range(len(phase_cost)):
            if phase_cost[step] < phase_cost[least]:
                least = step
        result[0], result[1] = view, (phase - least) % phases
        result[2] = min(max(here[0], 0), scales - 1)
        result[3] = min(max(here[1], 0), rows - 1)
        result[4] = min(max(here[2], 0), columns - 1)
    for k in range(3):
        result[2 + k] += first[k]

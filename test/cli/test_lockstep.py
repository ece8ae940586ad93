# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Every frame is answered once and in order, whatever becomes of it."""

import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest

from gait_segmentation.cli.lockstep import Replayed, ahead, open_heat_maps, results_of
from gait_segmentation.errors import InputError, SequenceError
from gait_segmentation.geometry import Box
from gait_segmentation.inputs import DamagedError, InputFrame
from gait_segmentation.pipeline import FrameResult
from test.cli.results import replayed
from test.inputs.bags import image_fields, stamp, write_bag2

MASK = np.full((8, 6), 255, np.uint8)
READ = [replayed(index, [(1, MASK, 0.0)]) for index in range(40)]


class LaggedPipeline:
    """Returns the result of the frame before; refuses the frames it is told to."""

    def __init__(self, refused: Iterable[int] = ()) -> None:
        self.config = SimpleNamespace(people=SimpleNamespace(max_people=1))
        self._refused = set(refused)
        self._waiting: list[FrameResult] = []

    def initialize(self, box: Box) -> None:
        raise AssertionError('no box was given')

    def reset(self) -> None:
        self._waiting.clear()

    def update(self, image: np.ndarray, stamp_ns: int) -> list[FrameResult]:
        (shown,) = (each for each in READ if each.frame.stamp_ns == stamp_ns)
        if shown.frame.number in self._refused:
            raise InputError('no use')
        done, self._waiting = self._waiting, [shown.result]
        return done

    def flush(self) -> list[FrameResult]:
        done, self._waiting = self._waiting, []
        return done


def run(
    frames: list[InputFrame],
    pipeline: Any,
    damaged: bool = False,
    warn: Callable[[str], None] = lambda text: None,
    box: Box | None = None,
) -> Iterator[Replayed]:
    def read() -> Iterator[InputFrame]:
        yield from frames
        if damaged:
            raise DamagedError('it breaks off')

    source: Any = SimpleNamespace(frames=read)
    return results_of(source, pipeline, box, warn)


def numbers(answers: Iterable[Replayed]) -> tuple[list[int], list[int]]:
    """Return the numbers of all frames, and of those in which somebody is seen."""
    made = list(answers)
    return (
        [each.frame.number for each in made],
        [each.frame.number for each in made if each.result.mask.any()],
    )


def test_frames_that_cannot_be_read_or_used_are_answered_in_their_place() -> None:
    frames = [each.frame for each in READ[:7]]
    frames[2] = replace(frames[2], image=None, problem='torn')
    frames[5] = replace(frames[5], stamp_ns=-(10**18))
    said: list[str] = []
    answers = list(run(frames, LaggedPipeline(refused=[0, 4]), warn=said.append))
    assert numbers(answers) == ([0, 1, 2, 3, 4, 5, 6], [1, 3, 6])
    # Nor does one before 1970 reset anything.
    assert said[-1] == f'frame 5 cannot be used: its stamp is {-(10**18)} ns'
    assert answers[2].result.people[0].segmentation.reason == 'torn'
    # Nobody is seen at the size at which others are.
    assert answers[4].result.people[0].track.likelihood.shape == (4, 3)
    assert answers[4].result.mask.shape == (8, 6)


@pytest.mark.parametrize(
    ('order', 'answered', 'starts'),
    [
        # What waits is answered before time jumps back, and the box is used again.
        ((38, 39, 1, 2), [38, 39, 1, 2], 2),
        # Stale frames are dropped with a warning.
        ((0, 3, 1, 2, 4, 5), [0, 3, 4, 5], 1),
        ((0, 1, 1, 2), [0, 1, 2], 1),
    ],
)
def test_where_time_jumps_back_it_begins_anew_or_drops_frames(
    order: tuple[int, ...], answered: list[int], starts: int, monkeypatch
) -> None:
    started: list[Box] = []
    warnings: list[str] = []
    pipeline: Any = LaggedPipeline()
    monkeypatch.setattr(pipeline, 'initialize', started.append)
    box = Box(1, 0, 3, 8)
    answers = run([READ[k].frame for k in order], pipeline, warn=warnings.append, box=box)
    assert numbers(answers) == (answered, answered)
    assert len(warnings) == len(order) - len(answered) + starts - 1
    assert started == [box] * starts


def test_all_frames_before_a_damage_are_answered() -> None:
    answers = run([each.frame for each in READ[:3]], LaggedPipeline(), damaged=True)
    assert [next(answers).frame.number for _ in range(3)] == [0, 1, 2]
    with pytest.raises(DamagedError):
        next(answers)


def test_items_come_in_order_and_then_the_error_and_what_is_given_up_is_closed() -> None:
    closed = []

    def items() -> Iterator[int]:
        try:
            yield from range(20)
            raise ValueError('here')
        finally:
            closed.append(threading.current_thread().name)

    found = []
    with pytest.raises(ValueError, match='here'):
        found.extend(ahead(items(), depth=3))
    assert found == list(range(20))
    assert list(ahead(iter([]))) == []
    with closing(ahead(items(), depth=2)) as numbers:
        assert [next(numbers), next(numbers)] == [0, 1]
    assert closed == ['ahead_0'] * 2


FRAME = InputFrame(0, stamp(0), 0, 0, '', (4, 6), None)


def shown(maps, number):
    frame = replace(FRAME, number=number, stamp_ns=stamp(number))
    return [(stamp_ns, int(read()[0, 0])) for stamp_ns, read in maps(frame)]


def test_maps_of_a_folder_are_told_by_number_or_stamp(tmp_path):
    for name, value in (('0000', 1), ('map_2', 2), (f'{stamp(3)}', 3)):
        cv2.imwrite(str(tmp_path / f'{name}.png'), np.full((4, 6), value, np.uint8))
    maps = open_heat_maps(str(tmp_path), tmp_path)
    assert [shown(maps, number) for number in range(4)] == [
        [(stamp(0), 1)],
        [],
        [(stamp(2), 2)],
        [(stamp(3), 3)],
    ]


def test_what_is_no_place_of_maps_is_refused(tmp_path):
    with pytest.raises(SequenceError, match='no images named by number or stamp'):
        open_heat_maps(str(tmp_path), tmp_path)
    with pytest.raises(SequenceError, match=r'no such folder, and .* is no bag'):
        open_heat_maps('/heat_map', tmp_path)


@pytest.mark.parametrize('encoding', ['mono8', '32FC1'])
def test_maps_on_a_topic_come_up_to_the_frame(tmp_path, encoding):
    messages = []
    for number in (0, 1, 4):
        value = np.full((4, 6), 51 * number, np.uint8)
        if encoding == '32FC1':
            value = (value / 255).astype(np.float32)
        message = image_fields(value, stamp(number), encoding)
        message.data = value.view(np.uint8).reshape(-1)
        messages.append(message)
    frames = [image_fields(np.zeros((8, 12, 3), np.uint8), stamp(0))]
    bag = write_bag2(tmp_path / 'walk', {'/image': frames, '/heat_map': messages})
    maps = open_heat_maps('/heat_map', bag)
    assert [shown(maps, number) for number in (0, 3, 4, 5)] == [
        [(stamp(0), 0)],
        [(stamp(1), 51)],
        [(stamp(4), 204)],
        [],
    ]
    with pytest.raises(SequenceError, match='topic /nothing is not there'):
        open_heat_maps('/nothing', bag)


def test_what_is_no_map_is_refused_when_it_is_read(tmp_path):
    messages = [image_fields(np.zeros((4, 6, 3), np.uint8), stamp(n)) for n in range(2)]
    messages.insert(0, image_fields(np.zeros((4, 6), np.uint8), stamp(0), 'mono8'))
    bag = write_bag2(tmp_path / 'walk', {'/heat_map': messages})
    maps = open_heat_maps('heat_map', bag)
    first, second = (read for _, read in maps(replace(FRAME, stamp_ns=stamp(0))))
    assert first().shape == (4, 6)
    with pytest.raises(InputError, match='must be mono8, 8UC1, mono16 or 32FC1'):
        second()

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import itertools
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from gait_segmentation.errors import SequenceError
from gait_segmentation.geometry import Box
from gait_tools.evaluation.runner import (
    check_truth,
    heat_maps_of,
    likelihoods_of,
    run,
)
from gait_tools.evaluation.sequence import Sequence

from .fakes import FakeMatching, FakePipeline, FakePipelineConfig, write_sequence


def ticking():
    return itertools.count().__next__


def run_sequence(pipeline, sequence, **options):
    return run(pipeline, sequence, sequence.numbers, sequence.starts, clock=ticking(), **options)


@pytest.fixture
def sequence(tmp_path):
    return Sequence.load(write_sequence(tmp_path / 'walk'))


def test_every_frame_is_run_from_the_first_box_on(sequence):
    pipeline = FakePipeline()
    outcomes = list(run_sequence(pipeline, sequence))
    assert pipeline.box == sequence.initial_box
    assert [outcome.number for outcome in outcomes] == list(range(8))
    assert all(outcome.score.j == 1 for outcome in outcomes)
    assert all(outcome.seconds == 1 for outcome in outcomes)
    assert outcomes[0].timings_ms['total'] == 6
    assert outcomes[0].phase == 0.25
    assert outcomes[0].score.tracked.iou == outcomes[0].score.matched.iou == 1


@pytest.mark.parametrize('lag', [1, 3, 10])
def test_late_results_are_matched_by_stamp(sequence, lag):
    pipeline = FakePipeline(FakePipelineConfig(matching=FakeMatching(lag=lag)))
    outcomes = list(run_sequence(pipeline, sequence))
    assert [outcome.number for outcome in outcomes] == list(range(8))
    assert all(outcome.score.j == 1 for outcome in outcomes)


class Forgetful(FakePipeline):
    """Says nothing about the first frame, and nothing about the last."""

    def update(self, image, stamp_ns, likelihood=None):
        results = super().update(image, stamp_ns, likelihood)
        return [] if len(self.likelihoods) in (1, 8) else results


def test_frames_without_a_result_count_as_empty(sequence):
    outcomes = list(run_sequence(Forgetful(), sequence))
    assert [outcome.number for outcome in outcomes] == list(range(8))
    assert [outcome.score.j for outcome in outcomes] == [0] + 6 * [1] + [0]
    assert outcomes[0].score.lost
    assert not outcomes[0].mask.any()
    assert outcomes[0].timings_ms == {}


class Repeating(FakePipeline):
    """Answers each frame twice, the second time without anybody, and some other frame besides."""

    def update(self, image, stamp_ns, likelihood=None):
        (result,) = super().update(image, stamp_ns, likelihood)
        (person,) = result.people
        nobody = SimpleNamespace(mask=np.zeros_like(person.segmentation.mask))
        again = SimpleNamespace(**vars(person) | {'segmentation': nobody})
        other = SimpleNamespace(**vars(result) | {'people': (again,)})
        unasked = SimpleNamespace(**vars(other) | {'stamp_ns': stamp_ns + 1})
        return [unasked, result, other]


def test_of_two_results_for_one_frame_the_first_counts(sequence):
    outcomes = list(run_sequence(Repeating(), sequence))
    assert [outcome.number for outcome in outcomes] == list(range(8))
    assert [outcome.score.j for outcome in outcomes] == [1] * 8


def test_frames_without_truth_are_run_but_not_scored(tmp_path):
    sequence = Sequence.load(write_sequence(tmp_path / 'walk', without_mask=(2, 3)))
    outcomes = list(run_sequence(FakePipeline(), sequence))
    assert [outcome.score is None for outcome in outcomes] == [n in (2, 3) for n in range(8)]
    assert outcomes[2].mask.any()


def test_a_sequence_without_masks_is_refused(tmp_path):
    sequence = Sequence.load(write_sequence(tmp_path / 'walk', without_mask=range(8)))
    with pytest.raises(SequenceError, match='no mask of a frame from 0 on'):
        check_truth(sequence)


def test_likelihoods_are_read_beside_the_frames(sequence):
    folder = sequence.folder / 'heat'
    with pytest.raises(SequenceError, match='heat is missing'):
        run_sequence(FakePipeline(), sequence, likelihood=likelihoods_of(sequence, 'heat'))
    folder.mkdir()
    for number in sequence.numbers:
        cv2.imwrite(str(folder / f'{number:04d}.png'), np.full((40, 48), number, np.uint8))
    pipeline = FakePipeline()
    list(run_sequence(pipeline, sequence, likelihood=likelihoods_of(sequence, 'heat')))
    assert [image[0, 0] for image in pipeline.likelihoods] == list(range(8))
    (folder / '0003.png').unlink()
    with pytest.raises(SequenceError, match=r'heat.0003\.png cannot be read'):
        list(run_sequence(FakePipeline(), sequence, likelihood=likelihoods_of(sequence, 'heat')))


def test_heat_maps_of_any_size_are_read_where_there_are_some(sequence):
    folder = sequence.folder / 'map'
    with pytest.raises(SequenceError, match='map is missing'):
        run_sequence(FakePipeline(), sequence, heat_map=heat_maps_of(sequence, 'map'))
    folder.mkdir()
    with pytest.raises(SequenceError, match=r'no heat map of a frame, such as .*0000\.png'):
        run_sequence(FakePipeline(), sequence, heat_map=heat_maps_of(sequence, 'map'))
    for number in (2, 5):
        cv2.imwrite(str(folder / f'{number:04d}.png'), np.full((4, 7), number, np.uint8))
    pipeline = FakePipeline()
    list(run_sequence(pipeline, sequence, heat_map=heat_maps_of(sequence, 'map')))
    assert {number: values.tolist() for number, (values, _) in pipeline.heat_maps.items()} == {
        number: 4 * [7 * [number]] for number in (2, 5)
    }
    cv2.imwrite(str(folder / '0003.png'), np.full((4, 7, 3), (1, 2, 3), np.uint8))
    with pytest.raises(SequenceError, match=r'0003\.png: heat map must be grey'):
        list(run_sequence(FakePipeline(), sequence, heat_map=heat_maps_of(sequence, 'map')))


@pytest.mark.parametrize(
    ('timing', 'own'),
    [
        (':0', {n: n for n in range(8)}),
        (':2', {n: n - 2 for n in range(2, 8)}),
        (':1:3', {1: 0, 4: 3, 7: 6}),
    ],
)
def test_heat_maps_come_late_with_the_stamps_of_their_own_frames(sequence, timing, own):
    (sequence.folder / 'map').mkdir()
    for number in sequence.numbers:
        cv2.imwrite(
            str(sequence.folder / f'map/{number:04d}.png'), np.full((4, 7), number, np.uint8)
        )
    pipeline = FakePipeline()
    list(run_sequence(pipeline, sequence, heat_map=heat_maps_of(sequence, f'map{timing}')))
    assert {came: int(values[0, 0]) for came, (values, _) in pipeline.heat_maps.items()} == own
    stamps = {came: stamp_ns for came, (_, stamp_ns) in pipeline.heat_maps.items()}
    assert stamps == {came: sequence.stamp_ns(number) for came, number in own.items()}


@pytest.mark.parametrize('name', ['map:late', 'map:1:0', ':3', 'map:-1'])
def test_how_late_heat_maps_come_must_be_a_number(sequence, name):
    with pytest.raises(SequenceError, match='NAME:LATE:EVERY, got'):
        heat_maps_of(sequence, name)


def test_masks_of_zeros_and_ones_are_refused(sequence):
    for path in sequence.masks.values():
        cv2.imwrite(str(path), np.minimum(cv2.imread(str(path), 0), 1))
    with pytest.raises(SequenceError, match='has a pixel of 255'):
        check_truth(sequence)


class Pair(FakePipeline):
    """Sees somebody else in its first slot, and the red man in its second; a third is lost."""

    def update(self, image, stamp_ns, likelihood=None):
        (result,) = super().update(image, stamp_ns, likelihood)
        (person,) = result.people
        other = np.zeros_like(person.segmentation.mask)
        other[6:35, 30:40] = 255
        first = SimpleNamespace(
            track=SimpleNamespace(
                track_id=8, box=Box(30, 6, 10, 29), body=None, state='tracked', features=()
            ),
            match=person.match,
            segmentation=SimpleNamespace(mask=other),
        )
        lost = SimpleNamespace(
            track=SimpleNamespace(track_id=9, box=None, body=None, state='lost'),
            match=person.match,
            segmentation=SimpleNamespace(mask=np.zeros_like(other)),
        )
        result.people = (first, person, lost)
        return [result]


def test_all_slots_that_see_somebody_are_told_and_the_fitting_one_is_scored(sequence):
    outcomes = list(run_sequence(Pair(), sequence))
    assert [outcome.score.j for outcome in outcomes] == [1] * 8
    assert [[each.track.track_id for each in outcome.people] for outcome in outcomes] == [
        [8, 1]
    ] * 8
    assert outcomes[0].people[0].track.box == Box(30, 6, 10, 29)
    assert outcomes[0].people[1].segmentation.mask is outcomes[0].mask


class Noting(FakePipeline):
    """Notes the boxes and before which frame they come."""

    def __init__(self):
        super().__init__()
        self.starts = []

    def initialize(self, box):
        self.starts.append((len(self.likelihoods), box))


def test_boxes_come_before_their_frames(sequence):
    pipeline = Noting()
    one, two = Box(1, 2, 3, 4), Box(5, 6, 7, 8)
    list(run(pipeline, sequence, range(2, 8), {4: (one, two), 6: (one,)}, clock=ticking()))
    assert pipeline.starts == [(2, one), (2, two), (4, one)]
    pipeline = Noting()
    list(run(pipeline, sequence, range(2, 8), one, clock=ticking()))
    assert pipeline.starts == [(0, one)]

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from types import SimpleNamespace

import numpy as np
import pytest

from gait_segmentation.geometry import Box
from gait_segmentation.matching import MatchingConfig
from gait_segmentation.pipeline import PipelineConfig
from gait_tools.evaluation.runner import run
from gait_tools.evaluation.sequence import Sequence

from .fakes import FakePipeline, run_sequence, write_sequence


@pytest.fixture
def sequence(tmp_path):
    return Sequence.load(write_sequence(tmp_path / 'walk'))


def test_every_frame_is_run_from_the_first_box_on(sequence):
    pipeline = FakePipeline()
    outcomes = run_sequence(pipeline, sequence)
    assert pipeline.box == sequence.initial_box
    assert [outcome.number for outcome in outcomes] == list(range(8))
    assert all(outcome.score.j == 1 for outcome in outcomes)
    assert all(outcome.seconds == 1 for outcome in outcomes)
    assert outcomes[0].timings_ms['total'] == 6
    assert outcomes[0].score.tracked.iou == outcomes[0].score.matched.iou == 1


@pytest.mark.parametrize('lag', [1, 3, 10])
def test_late_results_are_matched_by_stamp(sequence, lag):
    pipeline = FakePipeline(PipelineConfig(matching=MatchingConfig(lag=lag)))
    outcomes = run_sequence(pipeline, sequence)
    assert [outcome.number for outcome in outcomes] == list(range(8))
    assert all(outcome.score.j == 1 for outcome in outcomes)


class Forgetful(FakePipeline):
    """Says nothing about the first frame, and nothing about the last."""

    def update(self, image, stamp_ns, likelihood=None):
        results = super().update(image, stamp_ns, likelihood)
        return [] if len(self.likelihoods) in (1, 8) else results


def test_frames_without_a_result_count_as_empty(sequence):
    outcomes = run_sequence(Forgetful(), sequence)
    assert [outcome.number for outcome in outcomes] == list(range(8))
    assert [outcome.score.j for outcome in outcomes] == [0] + 6 * [1] + [0]
    assert outcomes[0].score.lost
    assert not outcomes[0].mask.any()
    assert outcomes[0].timings_ms == {}


class Pair(FakePipeline):
    """Sees somebody else in its first slot, and the red man in its second; a third is lost."""

    def update(self, image, stamp_ns, likelihood=None):
        (result,) = super().update(image, stamp_ns, likelihood)
        (person,) = result.people
        other = np.zeros_like(person.segmentation.mask)
        other[6:35, 30:40] = 255
        first = SimpleNamespace(
            track=SimpleNamespace(track_id=8, box=Box(30, 6, 10, 29), body=None, state='tracked'),
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
    outcomes = run_sequence(Pair(), sequence)
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
    list(run(pipeline, sequence, range(2, 8), {4: (one, two), 6: (one,)}, clock=lambda: 0.0))
    assert pipeline.starts == [(2, one), (2, two), (4, one)]

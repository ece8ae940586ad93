# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import itertools

from gait_segmentation.evaluation.restarts import restarts_of, run_restarts
from gait_segmentation.evaluation.sequence import Sequence

from .fakes import FakePipeline, write_sequence


def test_restarts_begin_at_every_tenth_frame_with_enough_to_follow(tmp_path):
    sequence = Sequence.load(write_sequence(tmp_path / 'a', frames=16, without_mask=(0,)))
    assert [numbers for numbers, _ in restarts_of(sequence)] == [[10, 11, 12, 13, 14, 15]]
    sequence = Sequence.load(write_sequence(tmp_path / 'b', frames=15))
    assert [numbers for numbers, _ in restarts_of(sequence)] == [list(range(14))]
    pipelines = []

    def make():
        pipelines.append(FakePipeline())
        return pipelines[-1]

    scores = list(run_restarts(make, sequence, clock=itertools.count().__next__))
    assert [(score.number, score.j, score.j0) for score in scores] == [(0, 1, 1)]
    assert len(pipelines[0].likelihoods) == 14
    # The box of the person with its rim, one pixel wide.
    assert pipelines[0].box == sequence.initial_box


def test_warm_runs_have_seen_all_frames_before_their_box(tmp_path):
    sequence = Sequence.load(write_sequence(tmp_path / 'a', frames=16))
    pipelines = []

    def make():
        pipelines.append(FakePipeline())
        return pipelines[-1]

    scores = list(run_restarts(make, sequence, clock=itertools.count().__next__, warm=True))
    assert [score.number for score in scores] == [0, 10]
    assert [len(pipeline.likelihoods) for pipeline in pipelines] == [14, 16]
    assert [score.j0 for score in scores] == [1, 1]

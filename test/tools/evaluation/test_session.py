# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from gait_segmentation.errors import SequenceError
from gait_segmentation.geometry import Box
from gait_segmentation.matching import MatchingConfig
from gait_segmentation.pipeline import PipelineConfig
from gait_tools.evaluation.report import table
from gait_tools.evaluation.sequence import Sequence
from gait_tools.evaluation.session import Session, load_sequences

from .fakes import FakePipeline, run_sequence, write_sequence


@pytest.fixture
def folders(tmp_path):
    return [write_sequence(tmp_path / 'a', frames=6), write_sequence(tmp_path / 'b', frames=16)]


def session(folders, **options):
    return Session(load_sequences(folders), FakePipeline, lambda: 0.0, **options)


@pytest.fixture
def made(monkeypatch):
    """Return the pipelines that are made."""
    pipelines, begin = [], FakePipeline.__init__

    def noted(self, config):
        begin(self, config)
        pipelines.append(self)

    monkeypatch.setattr(FakePipeline, '__init__', noted)
    return pipelines


def test_warm_starts_and_pictures_are_made_when_asked_for(folders, made, tmp_path):
    report = session(folders, warm=True).evaluate(PipelineConfig(), tmp_path / 'out')
    ones = {'J': 1, 'J0': 1}
    assert report['warm'] == ones | {'per_sequence': {'a': ones, 'b': ones}}
    # The clips themselves, and starts: at 0 of each, and at 10, which sees all before.
    assert [len(each.images) for each in made] == [6, 6, 16, 14, 16]
    assert 'warm J' in table(report)
    assert (tmp_path / 'out' / 'b' / 'contact_sheet.png').is_file()
    assert (tmp_path / 'out' / 'a' / 'masks' / '0005.png').is_file()


def label_another(folder, people=2):
    """Label the red man, and somebody who stands on the right, cut into more people."""
    (folder / 'labels').mkdir()
    for path in sorted((folder / 'masks').iterdir()):
        truth = cv2.imread(str(path), -1)
        labels = np.where(truth == 170, 255, np.where(truth == 255, 1, 0)).astype(np.uint8)
        labels[10:34, 40:46] = 2
        for person in range(3, people + 1):
            labels[10:16, 36 + 2 * person : 38 + 2 * person] = person
        cv2.imwrite(str(folder / 'labels' / path.name), labels)


def test_there_is_a_slot_for_everybody_who_is_labelled(folders, made):
    label_another(folders[0])
    report = session(folders).evaluate(PipelineConfig())
    assert [each.config.people.max_people for each in made] == [2, 1]
    people = report['sequences']['a']['tracking']['people']
    assert people['1']['J'] == 1
    assert people['2']['J'] == 0
    assert people['2']['lock_seconds'] is None
    assert report['mean']['tracking']['never_locked'] == 1


def test_warm_starts_have_one_slot_and_a_box(folders, made):
    label_another(folders[0])
    session(folders[:1], warm=True, auto=True).evaluate(PipelineConfig())
    assert made[0].box is None
    assert made[1].box is not None
    assert made[1].config.people.max_people == 1


@pytest.mark.parametrize(('people', 'slots'), [(1, 3), (4, 4)])
def test_whom_maps_show_has_one_of_three_slots_at_least(folders, made, people, slots):
    folder = folders[0]
    if people > 1:
        label_another(folder, people)
    (folder / 'maps').mkdir()
    for path in (folder / 'frames').iterdir():
        truth = cv2.imread(str(folder / 'masks' / path.name), 0)
        cv2.imwrite(str(folder / 'maps' / path.name), truth // 255 * 200)
    for options in ({}, {'heat_map': 'maps'}, {'heat_map': 'maps', 'auto': False}):
        session([folder], **{'auto': True, **options}).evaluate(PipelineConfig())
    fixed = frozenset(['people.max_people'])
    once = session([folder], auto=True, heat_map='maps:1', fixed=fixed)
    assert once.evaluate(PipelineConfig())['mean']['map_J'] == 1
    assert [each.config.people.max_people for each in made] == [people, slots, people, 1]
    assert [each.box is None for each in made] == [True, True, False, True]


def test_what_cannot_be_scored_is_refused(tmp_path):
    bare = write_sequence(tmp_path / 'bare', without_mask=range(8))
    with pytest.raises(SequenceError, match='no mask of a frame from 0 on'):
        load_sequences([bare])
    dark = write_sequence(tmp_path / 'dark')
    for path in (dark / 'masks').iterdir():
        cv2.imwrite(str(path), np.minimum(cv2.imread(str(path), 0), 1))
    with pytest.raises(SequenceError, match='has a pixel of 255'):
        load_sequences([dark])


@pytest.fixture
def sequence(tmp_path):
    return Sequence.load(write_sequence(tmp_path / 'walk'))


@pytest.mark.parametrize('lag', [0, 3, 10])
def test_every_frame_is_run_from_the_first_box_on_and_late_results_fit_by_stamp(sequence, lag):
    pipeline = FakePipeline(PipelineConfig(matching=MatchingConfig(lag=lag)))
    outcomes = run_sequence(pipeline, sequence)
    assert pipeline.box == sequence.initial_box
    assert [outcome.number for outcome in outcomes] == list(range(8))
    assert all(outcome.score.j == 1 for outcome in outcomes)
    assert outcomes[0].timings_ms['total'] == 6
    score = outcomes[0].score
    assert score.tracked.iou == score.placed.iou == score.matched.iou == 1
    assert lag or all(outcome.seconds == 1 for outcome in outcomes)


class Forgetful(FakePipeline):
    """Says nothing about the first frame, and nothing about the last."""

    def update(self, image, stamp_ns):
        results = super().update(image, stamp_ns)
        return [] if len(self.images) in (1, 8) else results


def test_frames_without_a_result_count_as_empty(sequence):
    outcomes = run_sequence(Forgetful(), sequence)
    assert [outcome.number for outcome in outcomes] == list(range(8))
    assert [outcome.score.j for outcome in outcomes] == [0] + 6 * [1] + [0]
    assert outcomes[0].score.lost
    assert not outcomes[0].mask.any()
    assert outcomes[0].timings_ms == {}


class Pair(FakePipeline):
    """Sees somebody else in its first slot, and the red man in its second; a third is lost."""

    def update(self, image, stamp_ns):
        (result,) = super().update(image, stamp_ns)
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

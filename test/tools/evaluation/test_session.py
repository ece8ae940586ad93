# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import itertools

import cv2
import numpy as np
import pytest

from gait_segmentation.errors import SequenceError
from gait_tools.evaluation.sequence import Sequence
from gait_tools.evaluation.session import Session, load_sequences, restarts_of

from .fakes import FakePipeline, FakePipelineConfig, write_sequence


@pytest.fixture
def folders(tmp_path):
    return [write_sequence(tmp_path / 'a', frames=6), write_sequence(tmp_path / 'b', frames=16)]


def session(folders, **options):
    clock = itertools.count().__next__
    return Session(load_sequences(folders), FakePipeline, clock, **options)


def test_all_sequences_are_in_the_report(folders):
    report = session(folders).evaluate(FakePipelineConfig())
    assert list(report['sequences']) == ['a', 'b']
    assert report['mean']['J'] == 1
    assert report['mean']['frames'] == 22
    assert 'restarts' not in report


def test_restarts_and_pictures_are_made_when_asked_for(folders, tmp_path):
    asked = session(folders, restarts=True, warm=True)
    report = asked.evaluate(FakePipelineConfig(), tmp_path / 'out')
    assert report['restarts']['J'] == report['warm']['J'] == 1
    assert list(report['restarts']['per_sequence']['b']['starts']) == ['0', '10']
    assert (tmp_path / 'out' / 'b' / 'contact_sheet.png').is_file()
    assert (tmp_path / 'out' / 'a' / 'masks' / '0005.png').is_file()


def test_progress_is_told_what_runs(folders):
    told = []

    def progress(items, name, total):
        told.append((name, total))
        return iter(items)

    session(folders, restarts=True, progress=progress).evaluate(FakePipelineConfig(), name='x')
    assert told == [('x a', 6), ('x a restarts', 1), ('x b', 16), ('x b restarts', 2)]


def test_two_sequences_of_one_name_are_refused(folders, tmp_path):
    again = write_sequence(tmp_path / 'other' / 'a')
    with pytest.raises(SequenceError, match='a name of its own'):
        load_sequences([*folders, again])


def label_another(folder):
    """Label the red man, and somebody who stands on the right."""
    (folder / 'labels').mkdir()
    for path in sorted((folder / 'masks').iterdir()):
        truth = cv2.imread(str(path), -1)
        labels = np.where(truth == 170, 255, np.where(truth == 255, 1, 0)).astype(np.uint8)
        labels[10:34, 40:46] = 2
        cv2.imwrite(str(folder / 'labels' / path.name), labels)


def test_there_is_a_slot_for_everybody_who_is_labelled(folders):
    label_another(folders[0])
    made = []

    def make(config):
        made.append(FakePipeline(config))
        return made[-1]

    clock = itertools.count().__next__
    report = Session(load_sequences(folders), make, clock).evaluate(FakePipelineConfig())
    assert [each.config.people.max_people for each in made] == [2, 1]
    people = report['sequences']['a']['tracking']['people']
    assert people['1']['J'] == 1
    assert people['2']['J'] == 0
    assert people['2']['lock_seconds'] is None
    assert report['mean']['tracking']['never_locked'] == 1

    fixed = Session(load_sequences(folders), make, clock, fixed=frozenset(['people.max_people']))
    fixed.evaluate(FakePipelineConfig())
    assert made[-2].config.people.max_people == 1


def test_restarts_have_one_slot_and_a_box(folders):
    label_another(folders[0])
    made = []

    def make(config):
        made.append(FakePipeline(config))
        return made[-1]

    sequences = load_sequences(folders[:1])
    clock = itertools.count().__next__
    Session(sequences, make, clock, restarts=True, auto=True).evaluate(FakePipelineConfig())
    assert made[0].box is None
    assert made[0].config.starting.auto_init == 'motion'
    assert made[1].box is not None
    assert made[1].config.people.max_people == 1
    assert made[1].config.starting.auto_init == 'none'


def test_nobody_is_told_of_when_people_must_be_found(folders):
    made = []

    def make(config):
        made.append(FakePipeline(config))
        return made[-1]

    clock = itertools.count().__next__
    Session(load_sequences(folders), make, clock, auto=True).evaluate(FakePipelineConfig())
    assert [each.box for each in made] == [None, None]


def test_restarts_begin_at_every_tenth_frame_with_enough_to_follow(tmp_path):
    sequence = Sequence.load(write_sequence(tmp_path / 'a', frames=16, without_mask=(0,)))
    assert [numbers for numbers, _ in restarts_of(sequence)] == [[10, 11, 12, 13, 14, 15]]
    sequence = Sequence.load(write_sequence(tmp_path / 'b', frames=15))
    # The box of the person with its rim, one pixel wide.
    assert restarts_of(sequence) == [(list(range(14)), sequence.initial_box)]


def test_warm_runs_have_seen_all_frames_before_their_box(folders):
    made = []

    def make(config):
        made.append(FakePipeline(config))
        return made[-1]

    clock = itertools.count().__next__
    both = Session(load_sequences(folders[1:]), make, clock, restarts=True, warm=True)
    report = both.evaluate(FakePipelineConfig())
    assert [len(each.likelihoods) for each in made] == [16, 14, 6, 14, 16]
    assert list(report['warm']['per_sequence']['b']['starts']) == ['0', '10']
    assert report['warm']['J0'] == 1

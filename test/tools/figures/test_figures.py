# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import math
import shutil
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from gait_segmentation.errors import ConfigError, SequenceError
from gait_segmentation.gait_model.bank import quantize
from gait_segmentation.geometry import Box
from gait_segmentation.matching import MatchingConfig
from gait_segmentation.paper.vocabulary import default_vocabulary
from gait_segmentation.pipeline import Pipeline, PipelineConfig
from gait_segmentation.results import MatchResult
from gait_segmentation.segmentation import SegmentationConfig
from gait_tools.figures.pictures import chosen, draw_frames, table_of
from gait_tools.figures.prior import draw_prior, steps_of
from gait_tools.figures.walk import Phases, Shot, Walk, figured, mean_scores, open_walk, record
from test.walkers import small_bank

EXAMPLE = Path(__file__).parents[3] / 'examples/walker'


@cache
def short(frames: int = 8) -> tuple[Shot, ...]:
    """Return the first frames of the example."""
    whole = open_walk(EXAMPLE, None)
    walk = Walk(
        'short', whole.box, lambda: (each for each in whole.frames() if each.number < frames)
    )
    return tuple(record(Pipeline(figured(PipelineConfig()), small_bank()), walk))


def test_a_sequence_has_box_truth_and_phases():
    walk = open_walk(EXAMPLE, None)
    first, *others = walk.frames()
    assert walk.name == 'walker'
    assert len(others) == 35
    assert first.truth is not None
    assert first.phase == 0.6806
    assert open_walk(EXAMPLE, Box(1, 2, 30, 60)).box == Box(1, 2, 30, 60)


def test_what_is_no_sequence_needs_a_box():
    with pytest.raises(SequenceError, match='--box is needed'):
        open_walk(EXAMPLE / 'frames', None)
    walk = open_walk(EXAMPLE / 'frames', Box(26, 41, 43, 110))
    given = next(walk.frames())
    assert given.image.shape == (192, 256, 3)
    assert given.truth is None
    assert math.isnan(given.phase)
    part = open_walk(EXAMPLE / 'frames', walk.box, start=3, count=2, width=128)
    assert part.box == Box(13, 20.5, 21.5, 55)
    assert [each.number for each in part.frames()] == [3, 4]
    assert next(part.frames()).image.shape == (96, 128, 3)
    with pytest.raises(ConfigError, match='--start is of a film'):
        open_walk(EXAMPLE, None, start=3)
    with pytest.raises(SequenceError, match=r'nothing\.mp4'):
        open_walk(EXAMPLE / 'nothing.mp4', walk.box)


@pytest.mark.parametrize('phases', ['[0.1, 0.2]', '[a, b]'])
def test_phases_that_are_none_are_refused(phases, tmp_path):
    folder = tmp_path / 'walker'
    shutil.copytree(EXAMPLE, folder)
    box = 'fps: 20\ninitial_box: [26, 41, 43, 110]\n'
    (folder / 'sequence.yaml').write_text(f'{box}phases: {phases}\n')
    with pytest.raises(SequenceError, match='must be 36 numbers'):
        open_walk(folder, None)
    (folder / 'sequence.yaml').write_text(box)
    assert math.isnan(next(open_walk(folder, None).frames()).phase)


@pytest.mark.parametrize(
    ('path', 'share'), [([0.9, 0.95, 0.05, 0.0, 0.1], 25), ([0.9], 0), ([0.1, 0.1, 0.2], 0)]
)
def test_steps_back_are_counted_and_the_turn_of_the_stride_is_none(path, share):
    path = np.array(path)
    assert Phases(np.arange(len(path)), path, path, path).backward(path) == share


def test_ambiguous_pixels_count_nothing_and_frames_without_truth_are_left_out() -> None:
    shots = list(short()[:3])
    for place, shot in enumerate(shots[:2]):
        mask = np.where(shot.given.truth != 0, 255, 0).astype(np.uint8)
        shots[place] = replace(shot, mask=mask)
        assert shots[place].error() == 0
    shots[2] = replace(shots[2], given=shots[2].given._replace(truth=None))
    assert math.isnan(shots[2].error())
    assert mean_scores(shots) == (2, 0, 1)
    assert mean_scores(shots[2:]) is None
    count, error, j = mean_scores([replace(s, mask=np.zeros_like(s.mask)) for s in short()])
    assert (count, j) == (8, 0)
    assert 5 < error < 50


@pytest.mark.parametrize('levels', [8, 256])
def test_the_table_adds_what_comparing_would(levels):
    shot, bank = short()[4], small_bank()
    table = table_of(shot, bank, MatchingConfig(levels=levels))
    templates = quantize(bank.templates[shot.match.sequence], levels)
    here = templates[:, table.row, table.column]
    assert (table.values == here[table.order]).all()
    assert (np.diff(table.values.astype(int)) >= 0).all()
    for value in range(256):
        assert table.first[value] == (here < value).sum()
        assert table.second[value] == (here <= value).sum()
    assert 30 <= table.value <= 225
    # Both IDs are worth a look.
    first, second = table.ids
    assert 0 < first < second < len(here)


def test_four_pictures_of_each_frame_are_drawn():
    nobody = replace(short()[0], match=MatchResult.empty(1, 0, (10, 10)))
    shots = chosen([nobody, *short()[1:]], 3)
    # Spread, and without those who are not matched.
    assert [shot.given.number for shot in shots] == [1, 4, 7]
    boxes, _, _, mask = np.reshape(draw_frames(shots, 12).axes, (4, 3))[:, 1]
    assert boxes.get_title() == 'frame 4: boxes'
    tracked, placed, _ = (each.get_xy() for each in boxes.patches)
    assert tracked.mean(axis=0) == pytest.approx(placed.mean(axis=0), abs=5)
    # What is shown is about the person.
    assert boxes.get_xlim()[0] < tracked[:, 0].min() < tracked[:, 0].max() < boxes.get_xlim()[1]
    assert mask.get_title().endswith('% wrong')
    bare = [replace(each, given=each.given._replace(truth=None)) for each in shots]
    assert draw_frames(bare, 12).axes[-1].get_title() == 'mask'


def test_the_steps_of_the_prior_agree_with_each_other() -> None:
    shot, config, vocabulary = short()[4], SegmentationConfig(), default_vocabulary()
    steps = steps_of(shot, config, vocabulary)
    assert steps is not None
    height, width = steps.psi.shape
    assert steps.image.shape == (height, width, 3)
    assert steps.by_word.shape == (vocabulary.words, height, width)
    points = steps.terms.points
    # An outline point is no way from those of its word.
    assert (steps.by_word[steps.words, points.rows, points.columns] == 0).all()
    # Edges of another word are further away, and nothing is nearer, than the outline.
    assert (steps.terms.distance >= steps.by_word.min(axis=0) - 1e-4).all()
    assert not (steps.far & steps.inside).any()
    assert draw_prior(steps, 4, config).get_figwidth() > 0
    black = replace(shot.match, shape_prior=np.zeros_like(shot.match.shape_prior))
    assert steps_of(replace(shot, match=black), config, vocabulary) is None

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import shutil

import pytest

from gait_segmentation.config import replaced
from gait_segmentation.errors import SequenceError
from gait_segmentation.geometry import Box
from gait_segmentation.pipeline import Pipeline, PipelineConfig
from gait_tools.figures.walk import Walk, figured, open_walk, record
from test.walkers import small_bank

from .shots import EXAMPLE, short


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
    assert given.phase is None
    with pytest.raises(SequenceError, match=r'nothing\.mp4'):
        open_walk(EXAMPLE / 'nothing.mp4', walk.box)


@pytest.mark.parametrize('phases', ['[0.1, 0.2]', '0.3', '[a, b]'])
def test_phases_that_are_none_are_refused(phases, tmp_path):
    folder = tmp_path / 'walker'
    shutil.copytree(EXAMPLE, folder)
    box = 'fps: 20\ninitial_box: [26, 41, 43, 110]\n'
    (folder / 'sequence.yaml').write_text(f'{box}phases: {phases}\n')
    with pytest.raises(SequenceError, match='must be 36 numbers'):
        open_walk(folder, None)
    (folder / 'sequence.yaml').write_text(box)
    assert next(open_walk(folder, None).frames()).phase is None


def test_every_frame_comes_back_also_with_a_lag():
    walk = Walk('two', open_walk(EXAMPLE, None).box, lambda: (shot.given for shot in short()))
    config = figured(replaced(PipelineConfig(), 'matching', 'lag', 3))
    shots = record(Pipeline(config, small_bank()), walk)
    assert [shot.given.number for shot in shots] == list(range(8))
    assert all(shot.match.stamp_ns == shot.given.stamp_ns for shot in shots)


def test_a_walk_without_anybody_is_an_error():
    class Nobody:
        def __getattr__(self, name):
            return lambda *_: []

    walk = open_walk(EXAMPLE, None)
    with pytest.raises(SequenceError, match='nobody was tracked'):
        record(Nobody(), walk)

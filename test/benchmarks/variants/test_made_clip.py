# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.variants import MadeClip
from gait_segmentation.errors import SequenceError
from gait_segmentation.geometry import Box
from gait_tools.evaluation.metrics import start_box
from gait_tools.evaluation.sequence import Sequence

from ...tools.evaluation.fakes import write_sequence
from .clips import clip_of


def test_a_clip_without_the_person_is_none() -> None:
    clip = clip_of()
    empty = [(image, np.zeros_like(truth)) for image, truth in clip.frames if truth is not None]
    assert clip.with_frames('empty', empty) is None
    late = replace(clip, box=Box(0, 0, 9, 9)).with_frames('late', [*empty[:3], *clip.frames[3:]])
    assert late is not None
    assert len(late.frames) == len(clip.frames) - 3
    assert late.box == start_box(clip.truth(3))


def test_frames_before_the_first_box_are_no_part_of_the_clip(tmp_path) -> None:
    folder = write_sequence(tmp_path / 'walk', frames=5)
    description = folder / 'sequence.yaml'
    sequence = Sequence.load(folder)
    clip = MadeClip.of(sequence)
    assert (clip.name, clip.fps, clip.box) == ('walk', sequence.fps, sequence.initial_box)
    assert [clip.stamp_ns(n) for n in clip.numbers] == [
        sequence.stamp_ns(n) for n in sequence.numbers
    ]
    description.write_text(description.read_text() + 'initial_frame: 2\n')
    later = MadeClip.of(Sequence.load(folder))
    assert later.numbers == [0, 1, 2]
    np.testing.assert_array_equal(later.image(0), clip.image(2))


def test_a_sequence_without_a_box_is_refused(tmp_path) -> None:
    sequence = replace(
        Sequence.load(write_sequence(tmp_path / 'walk', frames=3)), initial_box=None
    )
    with pytest.raises(SequenceError, match='walk has no initial_box'):
        MadeClip.of(sequence)


def test_a_camera_that_pans_does_not_stand_still() -> None:
    assert clip_of().still
    assert not clip_of(pan=3.0).still

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np

from benchmarks.variants import variants_of
from gait_segmentation.evaluation.metrics import start_box

from .clips import clip_of


def test_backwards_and_every_second_frame() -> None:
    clip = clip_of(frames=9)
    (back,), (fewer,) = variants_of('backwards', [clip]), variants_of('skip', [clip])
    np.testing.assert_array_equal(back.image(0), clip.image(8))
    np.testing.assert_array_equal(fewer.image(2), clip.image(4))
    assert fewer.stamp_ns(2) == clip.stamp_ns(4)


def test_starts_are_those_of_the_restart_score() -> None:
    starts = variants_of('start', [clip_of(frames=27)])
    assert [clip.name for clip in starts] == ['walk3@0', 'walk3@10', 'walk3@20']
    assert [len(clip.frames) for clip in starts] == [14, 14, 7]


def test_backwards_starts_where_the_person_left() -> None:
    clip = clip_of(frames=9)
    (back,) = variants_of('backwards', [clip])
    assert back.box == start_box(clip.truth(8))
    assert back.fps == clip.fps

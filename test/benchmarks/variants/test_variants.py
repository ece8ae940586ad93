# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from benchmarks.variants import KINDS, PAIRED, moved_boxes, variants_of
from gait_tools.evaluation.metrics import start_box

from .clips import clip_of


@pytest.mark.parametrize('kind', [*KINDS, *PAIRED])
def test_every_kind_makes_clips_that_start_about_the_person(kind: str) -> None:
    clips = [clip_of(), clip_of(seed=4)]
    made = variants_of(kind, clips[:1] if kind in KINDS else clips)
    assert made
    assert len({clip.name for clip in made}) == len(made)
    for clip in made:
        assert clip.image(0).dtype == np.uint8
        truth = clip.truth(0)
        assert truth is not None
        assert truth.shape == clip.image(0).shape[:2]
        box = start_box(truth)
        assert box is not None
        assert abs(box.center_x - clip.box.center_x) < 0.05 * box.height
        assert abs(box.height - clip.box.height) < 0.1 * box.height


def test_nothing_of_the_original_is_changed() -> None:
    clips = [clip_of(), clip_of(seed=4)]
    before = [[(image.copy(), truth) for image, truth in clip.frames] for clip in clips]
    for kind in (*KINDS, *PAIRED):
        variants_of(kind, clips[:1] if kind in KINDS else clips)
    for clip, frames in zip(clips, before, strict=True):
        for (image, _), (old, _) in zip(clip.frames, frames, strict=True):
            np.testing.assert_array_equal(image, old)


def test_moved_boxes_are_the_same_every_time_and_differ() -> None:
    clip = clip_of()
    first, again = moved_boxes(clip, 3), moved_boxes(clip, 3)
    assert [made.box for made in first] == [made.box for made in again]
    assert len({made.box for made in (*first, clip)}) == 4
    for made in first:
        assert abs(made.box.x - clip.box.x) < 0.06 * clip.box.height


def test_backwards_and_every_second_frame() -> None:
    clip = clip_of(frames=9)
    (back,), (fewer,) = variants_of('backwards', [clip]), variants_of('skip', [clip])
    np.testing.assert_array_equal(back.image(0), clip.image(8))
    np.testing.assert_array_equal(fewer.image(2), clip.image(4))
    assert fewer.stamp_ns(2) == clip.stamp_ns(4)


def test_backwards_starts_where_the_person_left() -> None:
    clip = clip_of(frames=9)
    (back,) = variants_of('backwards', [clip])
    assert back.box == start_box(clip.truth(8))
    assert back.fps == clip.fps

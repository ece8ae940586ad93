# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from gait_segmentation.evaluation.metrics import start_box, true_box
from gait_segmentation.evaluation.truth import AMBIGUOUS, PERSON
from gait_segmentation.evaluation.variants import (
    KINDS,
    PAIRED,
    MadeClip,
    moved_boxes,
    variants_of,
)
from gait_segmentation.geometry import Box
from test import walkers


def clip_of(pan: float = 0.0, frames: int = 10, seed: int = 3) -> MadeClip:
    made = walkers.clip(pan, frames, seed)
    pairs = tuple((frame.image, frame.truths[0]) for frame in made)
    box = start_box(pairs[0][1])
    assert box is not None
    return MadeClip(f'walk{seed}', 25.0, pairs, box)


def size_of(truth: np.ndarray | None) -> int:
    assert truth is not None
    return int(np.count_nonzero(truth == PERSON))


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


def test_backwards_and_every_second_frame() -> None:
    clip = clip_of(frames=9)
    (back,), (fewer,) = variants_of('backwards', [clip]), variants_of('skip', [clip])
    np.testing.assert_array_equal(back.image(0), clip.image(8))
    np.testing.assert_array_equal(fewer.image(2), clip.image(4))
    assert fewer.stamp_ns(2) == clip.stamp_ns(4)


def test_a_turned_camera_turns_the_truth_and_does_not_know_the_corners() -> None:
    clip = clip_of()
    for turned in variants_of('tilt', [clip]):
        truth = turned.truth(0)
        assert truth is not None
        assert truth[0, 0] == AMBIGUOUS
        assert size_of(truth) == pytest.approx(size_of(clip.truth(0)), rel=0.05)


def test_the_far_end_of_the_way_is_in_the_shade() -> None:
    clip = clip_of()
    for shaded in variants_of('shade', [clip]):
        light = float(shaded.name.rpartition('/')[2])
        last = len(clip.frames) - 1
        ends = [
            true_box(truth) for truth in (clip.truth(0), clip.truth(last)) if truth is not None
        ]
        (start, end) = ((round(box.bottom) - 1, round(box.center_x)) for box in ends if box)
        far = 2 * end[1] - start[1], 2 * start[1] - end[1]
        sums = [
            shaded.image(0)[:, column].sum() / clip.image(0)[:, column].sum() for column in far
        ]
        assert sums[0] == pytest.approx(light, abs=0.05)
        assert sums[1] == pytest.approx(1.0, abs=0.05)


def test_who_is_behind_loses_no_pixel_to_the_second_person_and_who_is_not_does() -> None:
    clip, other = clip_of(), clip_of(seed=4)
    behind, front = variants_of('two', [clip, other])
    assert 'behind' in behind.name
    assert 'front' in front.name
    middle = len(clip.frames) // 2
    assert size_of(behind.truth(middle)) > 0.85 * size_of(clip.truth(middle))
    assert size_of(front.truth(middle)) < 0.7 * size_of(clip.truth(middle))
    changed = (front.image(middle) != clip.image(middle)).any(axis=-1)
    assert changed[(clip.truth(middle) == PERSON) & (front.truth(middle) == 0)].mean() > 0.9


def test_a_pasted_person_keeps_their_pixels_and_loses_their_background() -> None:
    clip, other = clip_of(), clip_of(seed=4)
    (pasted,) = variants_of('pasted', [clip, other])
    truth = clip.truth(0)
    assert truth is not None
    person = (truth == PERSON).astype(np.uint8)
    inside = cv2.erode(person, np.ones((9, 9), np.uint8)) > 0
    np.testing.assert_allclose(pasted.image(0)[inside].astype(int), clip.image(0)[inside], atol=3)
    outside = truth == 0
    difference = np.abs(pasted.image(0)[outside].astype(int) - clip.image(0)[outside])
    assert difference.mean() > 10


def test_a_moving_camera_has_nothing_standing_in_the_way() -> None:
    assert not clip_of(pan=3.0).still
    assert variants_of('hidden', [clip_of(pan=3.0)]) == []


def test_what_hides_the_person_is_no_person() -> None:
    clip = clip_of()
    for hidden in variants_of('hidden', [clip]):
        middle = len(clip.frames) // 2
        changed = (hidden.image(middle) != clip.image(middle)).any(axis=-1)
        truth = hidden.truth(middle)
        assert truth is not None
        assert (truth[changed] == PERSON).mean() < 0.01
        assert size_of(truth) < size_of(clip.truth(middle))


def test_starts_are_those_of_the_restart_score() -> None:
    starts = variants_of('start', [clip_of(frames=27)])
    assert [clip.name for clip in starts] == ['walk3@0', 'walk3@10', 'walk3@20']
    assert [len(clip.frames) for clip in starts] == [14, 14, 7]


def test_moved_boxes_are_the_same_every_time_and_differ() -> None:
    clip = clip_of()
    first, again = moved_boxes(clip, 3), moved_boxes(clip, 3)
    assert [made.box for made in first] == [made.box for made in again]
    assert len({made.box for made in (*first, clip)}) == 4
    for made in first:
        assert abs(made.box.x - clip.box.x) < 0.06 * clip.box.height


def test_a_clip_without_the_person_is_none() -> None:
    clip = clip_of()
    empty = [(image, np.zeros_like(truth)) for image, truth in clip.frames if truth is not None]
    assert clip.with_frames('empty', empty) is None
    late = replace(clip, box=Box(0, 0, 9, 9)).with_frames('late', [*empty[:3], *clip.frames[3:]])
    assert late is not None
    assert len(late.frames) == len(clip.frames) - 3
    assert late.box == start_box(clip.truth(3))

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

from dataclasses import replace

from benchmarks.variants import variants_of
from gait_segmentation.evaluation.metrics import true_box
from gait_segmentation.evaluation.truth import PERSON

from .clips import clip_of, size_of


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


def test_where_next_to_nothing_is_left_nothing_counts() -> None:
    clip = clip_of()
    number = len(clip.frames) // 2 - 1
    image, truth = clip.frames[number]
    assert truth is not None
    box = true_box(truth)
    assert box is not None
    frames = list(clip.frames)
    for share, counts in ((0.37, False), (1.0, True)):
        part = truth.copy()
        part[: round(box.bottom - share * box.height)] = 0
        frames[number] = (image, part)
        *_, bench = variants_of('hidden', [replace(clip, frames=tuple(frames))])
        seen = bench.truth(number)
        assert (size_of(seen) > 0) == counts

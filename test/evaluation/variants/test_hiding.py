# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

from gait_segmentation.evaluation.truth import PERSON
from gait_segmentation.evaluation.variants import variants_of

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

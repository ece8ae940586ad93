# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import cv2
import numpy as np

from benchmarks.variants import variants_of
from gait_tools.evaluation.truth import PERSON

from .clips import clip_of, size_of


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

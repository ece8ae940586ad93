# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.variants import variants_of
from gait_tools.evaluation.metrics import true_box
from gait_tools.evaluation.truth import AMBIGUOUS, PERSON

from .clips import clip_of, size_of


def mean_of(kind: str, number: int = 0) -> float:
    (made,) = variants_of(kind, [clip_of()])
    return float(made.image(number).mean())


def test_a_mirror_swaps_the_sides_of_image_and_truth() -> None:
    clip = clip_of()
    (made,) = variants_of('flip', [clip])
    np.testing.assert_array_equal(made.image(3), clip.image(3)[:, ::-1])
    np.testing.assert_array_equal(made.truth(3), clip.truth(3)[:, ::-1])


@pytest.mark.parametrize(('kind', 'scale'), [('half', 0.5), ('double', 2.0)])
def test_another_size_scales_image_truth_and_box(kind: str, scale: float) -> None:
    clip = clip_of()
    (made,) = variants_of(kind, [clip])
    height, width = clip.image(0).shape[:2]
    assert made.image(0).shape == (scale * height, scale * width, 3)
    assert size_of(made.truth(0)) == pytest.approx(scale**2 * size_of(clip.truth(0)), rel=0.03)
    assert made.box.height == pytest.approx(scale * clip.box.height, abs=2)


def test_dark_flat_and_grey_images_have_the_levels_that_they_say() -> None:
    usual = mean_of('plain')
    assert mean_of('dark') == pytest.approx(0.3 * usual, abs=1)
    assert mean_of('low') == pytest.approx(0.35 * usual + 90, abs=1)
    (made,) = variants_of('grey', [clip_of()])
    assert (made.image(0) == made.image(0)[..., :1]).all()


def test_a_gain_that_hunts_goes_up_and_down_by_a_quarter() -> None:
    clip = clip_of(frames=31)
    (made,) = variants_of('gain', [clip])
    for number, gain in ((0, 1.0), (10, 1.25), (20, 1.0), (30, 0.75)):
        ratio = made.image(number).mean() / clip.image(number).mean()
        assert ratio == pytest.approx(gain, abs=0.03)


def test_noise_blur_and_compression_change_the_image_a_little_and_the_truth_not_at_all() -> None:
    clip = clip_of()
    for kind in ('noise', 'blur', 'jpeg'):
        (made,) = variants_of(kind, [clip])
        difference = np.abs(made.image(2).astype(int) - clip.image(2))
        assert 1 < difference.mean() < 15, kind
        np.testing.assert_array_equal(made.truth(2), clip.truth(2))
        assert made.box == clip.box


def test_a_turned_camera_turns_the_truth_and_does_not_know_the_corners() -> None:
    clip = clip_of()
    for turned in variants_of('tilt', [clip]):
        truth = turned.truth(0)
        assert truth is not None
        assert truth[0, 0] == AMBIGUOUS
        assert size_of(truth) == pytest.approx(size_of(clip.truth(0)), rel=0.05)


def test_a_moving_camera_sees_no_shade_that_would_pass_over_the_ground() -> None:
    assert variants_of('shade', [clip_of(pan=3.0)]) == []
    assert len(variants_of('shade', [clip_of()])) == 2


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

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Made-up clips: the camera, the place, walkers and what they wear, things, and the truth."""

import itertools
import math

import numpy as np
import pytest

from benchmarks.synthetic import SyntheticConfig, SyntheticSequence
from benchmarks.synthetic.things import THINGS, ThingClip
from benchmarks.synthetic.walkers import Walker, make_outfit
from gait_segmentation.errors import SequenceError
from gait_segmentation.geometry import Box
from gait_tools.evaluation.sequence import Sequence


def someone():
    outfit = make_outfit(np.random.default_rng(0))
    return Walker(0.0, 3.0, 0.0, 1.0, 0.25, 'average', outfit)


def small(**changes):
    values = {'width': 160, 'height': 120, 'frames': 10, 'person_height': 60.0, **changes}
    return SyntheticConfig(**values)


def test_the_same_seed_gives_the_same_bits_in_any_order():
    first, second = SyntheticSequence(small(walkers=2)), SyntheticSequence(small(walkers=2))
    frames = [frame.image for frame in first]
    assert len(frames) == 10
    for number in (7, 0, 3):
        np.testing.assert_array_equal(second.frame(number).image, frames[number])
    other = SyntheticSequence(small(walkers=2, seed=1))
    assert (other.frame(0).image != frames[0]).mean() > 0.5


def test_frames_agree_with_their_truth():
    clip = SyntheticSequence(small(walkers=3, shadow=True, seed=2))
    for frame in clip:
        assert frame.image.shape == (120, 160, 3)
        assert frame.image.dtype == np.uint8
        for index, (mask, box) in enumerate(zip(frame.masks, frame.boxes, strict=True)):
            np.testing.assert_array_equal(mask > 0, frame.labels == index + 1)
            assert Box.around(mask) == box
        sure = frame.truths[0] == 255
        assert (frame.masks[0][sure] == 255).all()
        assert set(np.unique(frame.truths[0])) <= {0, 170, 255}


def test_walkers_go_where_they_are_sent():
    def centers(azimuth):
        clip = SyntheticSequence(small(azimuth=azimuth, jitter=0.0))
        return [clip.frame(number).boxes[0] for number in (0, 9)]

    first, last = centers(0.0)
    # Ten frames at 25/s: 0.36 s of 0.9 strides/s of 0.83 heights of 60 px.
    assert last.center_x - first.center_x == pytest.approx(0.36 * 0.9 * 0.83 * 60, abs=6)
    first, last = centers(math.pi)
    assert last.center_x < first.center_x - 8
    first, last = centers(math.pi / 2)
    assert last.height < first.height
    first, last = centers(-math.pi / 2)
    assert last.height > first.height


def test_the_phase_runs_at_the_stride_rate_from_the_near_leg():
    right = SyntheticSequence(small(stride_rate=1.0))
    steps = np.diff([frame.phases[0] for frame in right]) % 1
    np.testing.assert_allclose(steps, 1 / 25)
    left = SyntheticSequence(small(stride_rate=1.0, azimuth=math.pi))
    difference = (left.frame(0).phases[0] - right.frame(0).phases[0]) % 1
    assert difference == pytest.approx(0.5)
    assert someone().near_phase_at(0.5) == 0.75
    assert left.frame(0).azimuths[0] == math.pi


@pytest.mark.parametrize('order', [(0, 1), (1, 0)])
def test_who_is_nearer_hides_who_is_farther(order):
    outfit = make_outfit(np.random.default_rng(0))
    pair = [Walker(0.0, z, 0.0, 0.0, 0.25, 'average', outfit) for z in (2.5, 4.0)]
    clip = SyntheticSequence(small(walkers=2, jitter=0.0))
    clip.walkers[:] = [pair[each] for each in order]
    near, far = (clip.frame(5).masks[order.index(each)] > 0 for each in (0, 1))
    clip = SyntheticSequence(small(jitter=0.0))
    clip.walkers[:] = pair[:1]
    np.testing.assert_array_equal(near, clip.frame(5).masks[0] > 0)
    assert far.sum() < near.sum() / 10


def test_all_walkers_are_labelled(tmp_path):
    clip = SyntheticSequence(small(frames=3, walkers=2, seed=1))
    clip.write(tmp_path / 'made')
    sequence = Sequence.load(tmp_path / 'made')
    for frame in clip:
        labels = sequence.labels(frame.number)
        np.testing.assert_array_equal(labels, frame.true_labels)
        sure = labels != 255
        np.testing.assert_array_equal(labels[sure], frame.labels[sure])
        assert (~sure).any()
    assert sequence.attendance.people == (1, 2)


def test_the_first_walker_may_come_later(tmp_path):
    outfit = make_outfit(np.random.default_rng(0))
    away = Walker(9.0, 2.9, 0.0, 0.9, 0.0, 'average', outfit)
    clip = SyntheticSequence(small(frames=3, walkers=2, seed=1))
    clip.walkers[0] = away
    clip.write(tmp_path / 'made')
    sequence = Sequence.load(tmp_path / 'made')
    assert sequence.initial_box is None
    assert list(sequence.starts) == [0]
    clip = SyntheticSequence(small(frames=3))
    clip.walkers[0] = away
    with pytest.raises(SequenceError, match='nobody is to be seen'):
        clip.write(tmp_path / 'empty')


@pytest.mark.parametrize('name', THINGS)
def test_a_thing_moves_and_is_no_larger_than_the_picture(name):
    (first, _), *_, (last, stamp_ns) = itertools.islice(ThingClip(name), 20)
    changed = np.abs(first.astype(int) - last).max(axis=2) > 25
    assert 0.001 < changed.mean() < 0.8
    assert first.shape == (240, 320, 3)
    assert stamp_ns > 0

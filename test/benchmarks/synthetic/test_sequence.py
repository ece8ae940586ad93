# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import math

import numpy as np
import pytest

from benchmarks.synthetic import SyntheticSequence
from benchmarks.synthetic.camera import SyntheticConfig
from benchmarks.synthetic.clothing import make_outfit
from benchmarks.synthetic.walkers import Walker, Whereabouts, draw_walker
from gait_segmentation.errors import SequenceError
from gait_segmentation.geometry import BodyFrame, Box
from gait_tools.evaluation.metrics import true_box
from gait_tools.evaluation.sequence import Sequence

HERE = Whereabouts(0.0, 3.0, 0.0, 0.25)


def someone():
    outfit = make_outfit(np.random.default_rng(0))
    return Walker(0.0, 3.0, 0.0, 1.0, 0.25, 'average', outfit)


def small(**changes):
    values = {'width': 160, 'height': 120, 'frames': 10, 'person_height': 60.0, **changes}
    return SyntheticConfig(**values)


def test_the_same_seed_gives_the_same_bits_in_any_order():
    first, second = SyntheticSequence(small(walkers=2)), SyntheticSequence(small(walkers=2))
    frames = [frame.image for frame in first]
    assert len(frames) == len(first) == 10
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
    assert someone().near_phase(0.5) == 0.75
    assert left.frame(0).azimuths[0] == math.pi


def test_a_shadow_darkens_the_ground_only():
    bare = SyntheticSequence(small(seed=4, noise=0.0, blur=0.0)).frame(5)
    shaded = SyntheticSequence(small(seed=4, noise=0.0, blur=0.0, shadow=True)).frame(5)
    np.testing.assert_array_equal(bare.masks[0], shaded.masks[0])
    outside = bare.truths[0] == 0
    darker = bare.image.astype(int) - shaded.image
    assert darker[outside].min() >= -1
    assert (darker[outside] > 15).any()
    assert np.abs(darker[bare.truths[0] == 255]).max() <= 1


def test_walkers_may_come_past_the_camera():
    clip = SyntheticSequence(small(azimuth=-math.pi / 2, frames=120, width=64, height=64))
    assert clip.frame(119).boxes[0] is None
    assert clip.frame(119).image.shape == (64, 64, 3)


def test_a_clip_is_written_as_a_sequence(tmp_path):
    clip = SyntheticSequence(small(frames=3))
    clip.write(tmp_path / 'made')
    sequence = Sequence.load(tmp_path / 'made')
    assert sequence.numbers == [0, 1, 2]
    assert sequence.initial_box == clip.initial_box
    assert sequence.stamp_ns(2) == clip.stamp_ns(2)
    np.testing.assert_array_equal(sequence.image(2), clip.frame(2).image)
    np.testing.assert_array_equal(sequence.truth(1), clip.frame(1).truths[0])
    assert true_box(sequence.truth(0)) is not None


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


def test_the_body_stands_where_it_should():
    picture = np.zeros((120, 100, 3), np.float32)
    cover = draw_walker(picture, someone(), BodyFrame(50.3, 60.6, 80), HERE, shadow=False)
    rows = np.flatnonzero((cover > 0.5).any(axis=1))
    assert rows[0] == pytest.approx(20.6, abs=3)
    assert rows[-1] + 1 == pytest.approx(100.6, abs=3)
    assert np.abs(np.average(np.arange(100) + 0.5, weights=cover.sum(axis=0)) - 50.3) < 4
    assert picture[cover > 0.9].min() >= 0
    assert not picture[cover == 0].any()


@pytest.mark.parametrize('x', [-200, -5, 105, 300])
def test_walkers_may_be_partly_or_wholly_outside(x):
    picture = np.full((60, 100, 3), 90, np.float32)
    cover = draw_walker(picture, someone(), BodyFrame(x, 30, 80), HERE, shadow=True)
    assert cover.shape == (60, 100)
    assert cover.any() == (abs(x - 50) < 100)

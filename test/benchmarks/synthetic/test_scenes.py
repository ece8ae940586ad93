# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import cv2
import numpy as np
import pytest

from benchmarks.synthetic.scenes import SCENES, scene
from gait_segmentation.errors import InputError


def areas(clip, numbers):
    """Return (frames, walkers) visible pixels."""
    return np.array([[(m > 0).sum() for m in clip.frame(number).masks] for number in numbers])


@pytest.mark.parametrize('name', SCENES)
def test_scenes_are_described(name):
    assert SCENES[name].__doc__.endswith('.')
    clip = scene(name)
    assert clip.image(75).shape == (480, 640, 3)
    assert any(clip.frame(number).boxes[0] is not None for number in (0, 75))


@pytest.mark.parametrize('name', ['crossing', 'trees'])
def test_scenes_are_repeatable(name):
    clip = scene(name, 1)
    middle = clip.frame(len(clip) // 2)
    again = scene(name, 1).frame(len(clip) // 2)
    np.testing.assert_array_equal(middle.image, again.image)
    np.testing.assert_array_equal(middle.labels, again.labels)


def test_an_unknown_scene_is_an_error():
    with pytest.raises(InputError, match=r"one of crossing, .*, got 'snow'"):
        scene('snow')


def test_each_pair_crosses_twice():
    clip = scene('crossing')
    xs = np.array(
        [[w.at(clip.seconds(n)).x / w.at(clip.seconds(n)).z for w in clip.walkers]
         for n in clip.numbers]
    )  # fmt: skip
    assert xs.shape[1] == 3
    for first, second in ((0, 1), (0, 2), (1, 2)):
        before = np.sign(xs[:, first] - xs[:, second])
        assert (before[1:] != before[:-1]).sum() == 2
    assert (areas(clip, [0]) > 1000).all()


def test_the_pillar_hides_somebody_for_0_7_seconds():
    clip = scene('pillar')
    numbers = (42, 46, 47, 48, 49, 57, 65, 66, 67, 68, 72)
    seen = dict(zip(numbers, areas(clip, numbers)[:, 0], strict=True))
    last = max(number for number, area in seen.items() if area > 0 and number < 57)
    first = min(number for number, area in seen.items() if area > 0 and number > 57)
    assert 17 <= first - last - 1 <= 19
    assert seen[57] == 0
    assert seen[42] > 300
    assert seen[72] > 300


def test_one_leaves_and_another_comes():
    seen = areas(scene('exit-enter'), range(0, 175, 14)) > 0
    assert seen[0].tolist() == [True, False]
    assert seen[-1].tolist() == [False, True]
    assert not (seen[:, 0] & seen[:, 1]).any()
    assert (~seen).all(axis=1).any()


def test_the_disguises_are_what_they_say():
    frame = scene('same-colour').frame(50)
    inside, outside = frame.truths[0] == 255, frame.truths[0] == 0
    means = [frame.image[part].mean(axis=0) for part in (inside, outside)]
    np.testing.assert_allclose(*means, atol=10)
    frame = scene('same-lightness').frame(50)
    inside, outside = frame.truths[0] == 255, frame.truths[0] == 0
    grey = cv2.cvtColor(frame.image, cv2.COLOR_BGR2GRAY).astype(float)
    assert grey[inside].mean() == pytest.approx(grey[outside].mean(), abs=10)
    means = [frame.image[part].mean(axis=0) for part in (inside, outside)]
    assert np.abs(means[0] - means[1]).max() > 40


def test_exposure_jumps_and_knocks_are_there():
    clip = scene('exposure')
    brightness = [clip.image(number).mean() for number in (24, 25, 44, 45)]
    assert brightness[1] > 1.2 * brightness[0]
    assert brightness[3] < 0.7 * brightness[2]
    clip = scene('shaken')
    centers = [clip.frame(number).boxes[0].center_x for number in (29, 30, 31)]
    assert centers[1] - centers[0] == pytest.approx(40, abs=12)
    assert centers[2] - centers[1] == pytest.approx(-40, abs=12)


def test_a_grey_camera_sees_grey():
    image = scene('grey').image(0)
    assert (image[..., :1] == image[..., 1:]).all()


def test_somebody_stands_still():
    clip = scene('standing')
    places = np.array([clip.frame(number).boxes[0].center_x for number in range(60, 110, 10)])
    assert np.abs(places - places[0]).max() < 2

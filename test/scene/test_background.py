# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from collections.abc import Sequence

import cv2
import numpy as np
import pytest

from gait_segmentation.colour import gray_lab
from gait_segmentation.scene.background import BackgroundModel
from gait_segmentation.scene.ego_motion import WorldMotion


def texture(seed: int = 0, shape: tuple[int, int] = (60, 80)) -> np.ndarray:
    return np.random.default_rng(seed).integers(0, 255, (*shape, 3)).astype(np.uint8)


NOBODY = np.zeros((60, 80), np.uint8)


def learnt(lab: np.ndarray, person: np.ndarray | None = None, frames: int = 1) -> BackgroundModel:
    model = BackgroundModel(lab.shape[:2])
    for _ in range(frames):
        model.add(lab, np.zeros(lab.shape[:2], np.uint8) if person is None else person)
    return model


def test_it_learns_the_mean_where_nobody_is_and_moves_with_the_camera() -> None:
    lab, person = texture(), NOBODY.copy()
    person[20:40, 30:50] = 255
    model = learnt(lab, person, 3)
    assert model.mean[10, 10] == pytest.approx(lab[10, 10].astype(float))
    assert model.count[10, 10] == 3
    assert model.count[30, 40] == 0
    assert model.moved([WorldMotion()]) is model
    pan = WorldMotion(np.array([[1.0, 0, 5], [0, 1, -3], [0, 0, 1]]))
    model.sigma, model.misplacement = 7.0, 0.4
    model = model.moved([pan, WorldMotion()])
    assert (model.sigma, model.misplacement) == (7.0, 0.4)
    assert model.mean[10, 20] == pytest.approx(lab[13, 15].astype(float), abs=0.01)
    # What left is forgotten.
    assert model.count[10, 2] == 0
    assert 2.7 < model.count[10, 20] < 3


def test_stripes_keep_their_contrast_while_the_camera_trembles() -> None:
    rows = 120 + 50 * np.sin(2 * np.pi * np.arange(60) / 5)
    lab = np.repeat(np.repeat(rows[:, None, None], 80, axis=1), 3, axis=2).astype(np.uint8)
    model = learnt(lab)
    for dy in (0.3, -0.4, 0.2, -0.3, 0.4, -0.2):
        model = model.moved([WorldMotion(np.array([[1.0, 0, 0.1], [0, 1, dy], [0, 0, 1]]))])
    inner = (slice(10, 50), slice(10, 70), 0)
    assert model.mean[inner].std() > 0.85 * lab[inner].std()


def test_noise_is_measured_on_the_surroundings_only() -> None:
    lab, person = np.full((60, 80, 3), 100, np.uint8), NOBODY.copy()
    person[:, 40:] = 255
    model = learnt(lab, person)
    changed = lab.copy()
    changed[:, 40:] = 250
    window, before = (slice(0, 60), slice(0, 80)), model.sigma
    model.measure_noise(lab, person, [window])
    # One frame by a tenth; of a picture without noise 1.5 levels are left.
    assert model.sigma == pytest.approx(max(0.9 * before + 0.15, 2.5), abs=0.01)
    for _ in range(60):
        model.measure_noise(changed, person, [window])
    assert model.sigma == pytest.approx(2.5, abs=0.1)
    for _ in range(60):
        model.measure_noise(lab + np.uint8(8), person, [window])
    assert model.sigma > 10


def test_how_much_of_what_is_known_a_frame_shows() -> None:
    wall, window = np.full((60, 80, 3), 150, np.uint8), (slice(0, 60), slice(0, 80))
    model, now, person = learnt(wall, frames=3), wall.copy(), NOBODY.copy()
    now[:, :20] = 30
    assert model.agreement(now, person, [window]) == pytest.approx(0.75, abs=0.03)
    person[:, :20] = 255
    assert model.agreement(now, person, [window]) == 1
    assert model.agreement(now, NOBODY, [(slice(0, 12), slice(0, 30))]) == 1, 'few pixels tell'


def test_what_is_surely_something_else_contradicts_the_known_background() -> None:
    wall, unseen = np.full((60, 80, 3), (150, 128, 128), np.uint8), NOBODY.copy()
    unseen[:, 60:] = 255
    now, window = wall.copy(), (slice(10, 50), slice(0, 80))
    # Darker than any shadow, a shadow, another hue, and where it was never seen.
    now[:, :20], now[:, 20:30], now[:, 30:40], now[:, 60:] = 40, 100, (150, 160, 128), 0
    now[:, :30, 1:] = 128
    strange = learnt(wall, unseen, 3).within(window).contradicted(now[10:50].copy(), 0.5)
    expected = np.zeros((40, 80), np.uint8)
    expected[:, :20] = expected[:, 30:40] = 1
    assert np.array_equal(strange, expected)


def _stairs(shift: float) -> np.ndarray:
    """Return flat stripes with soft edges."""
    x = np.arange(200)[None, :] + shift
    levels = 128 + sum(50 * (-1) ** k * np.tanh((x - 40 * k - 20) / 2) for k in range(5))
    return np.repeat(np.repeat(levels, 80, axis=0)[..., None], 3, axis=2)


@pytest.mark.parametrize(('shift', 'low', 'high'), [(0.0, 0.0, 0.05), (0.8, 0.5, 1.3)])
def test_misplacement_is_measured_where_the_background_is_steep(shift, low, high) -> None:
    nobody = np.zeros((80, 200), np.uint8)
    model = learnt(np.rint(_stairs(0.0)).astype(np.uint8))
    rng = np.random.default_rng(0)
    for _ in range(30):
        noisy = np.clip(_stairs(shift) + rng.normal(0, 1.5, (80, 200, 3)), 0, 255)
        model.measure_noise(noisy.astype(np.uint8), nobody, [(slice(0, 80), slice(0, 200))])
    assert low <= model.misplacement <= high


def test_a_jolt_counts_in_the_frame_that_shows_it() -> None:
    nobody, model = np.zeros((80, 200), np.uint8), learnt(np.uint8(np.rint(_stairs(0.0))))

    def after(shift: float, people: np.ndarray = nobody) -> float:
        every = [(slice(0, 80), slice(0, 200))]
        model.notice_jolt(np.uint8(np.rint(_stairs(shift))), people, every)
        return model.misplacement

    jolted = after(1.0)
    assert jolted > 0.6
    assert after(0.0) == jolted, 'only what is learnt lowers it'
    assert after(1.2) == jolted, 'drift is no jolt'
    assert after(2.0, nobody + 255) == jolted, 'people are not the background'


def test_what_is_known_from_elsewhere_counts_where_less_is_known() -> None:
    model, other = learnt(np.full((1, 3, 3), 50, np.uint8)), BackgroundModel((1, 3))
    other.sums[0] = [(0, 0, 0, 0), (90, 90, 90, 1), (450, 450, 450, 5)]
    model.merge(other)
    assert model.count[0].tolist() == [1, 1, 5]
    assert model.mean[0, :, 0].tolist() == [50, 50, 90]


WALL = (190, 124, 135)


def evidence(colour: Sequence[float], count: int = 10, wall: Sequence[float] = WALL) -> float:
    """Return what is said of a colour before a wall that was seen some times."""
    model = learnt(np.full((20, 30, 3), wall, np.uint8), frames=count)
    model.sigma = 4.0
    lab = np.full((20, 30, 3), np.rint(colour), np.uint8)
    return float(model.evidence(lab, 0.5)[0, 0])


@pytest.mark.parametrize('share', [0.95, 0.85, 0.75])
def test_shade_on_a_wall_is_the_wall_the_lighter_the_surer(share: float) -> None:
    lightness, chroma = WALL[0], (np.array(WALL[1:]) - 128)
    a, b = 128 + share * chroma
    said = evidence((share * lightness, a, b))
    assert evidence(WALL) <= said < -1
    assert said < evidence(((share - 0.1) * lightness, a, b))


def test_what_is_lighter_or_coloured_or_black_is_no_wall() -> None:
    lightness, a, b = WALL
    assert evidence((1.2 * lightness, a, b)) > 1
    assert evidence((0.85 * lightness, a + 20, b)) > 1
    assert evidence((0.3 * lightness, a, b)) > 1
    # Shade takes colour away in proportion to the light.
    for wall in ((190.0, 180.0, 128.0), (190.0, 128.0, 180.0)):
        shaded = 0.8 * np.array(wall) + 0.2 * np.array([0.0, 128.0, 128.0])
        assert evidence(shaded.tolist(), wall=wall) < -1
    # Where nothing is known nothing is said.
    assert evidence(WALL, count=0) == evidence((20, 128, 128), count=1) == 0
    assert abs(evidence(WALL, count=2)) < abs(evidence(WALL, count=9))


def test_a_faded_background_has_the_texture_of_its_lightness() -> None:
    gray, person = cv2.blur(texture()[..., 0], (5, 5)), NOBODY.copy()
    person[20:40, 30:50] = 255
    coloured = cv2.cvtColor(cv2.cvtColor(gray, cv2.COLOR_GRAY2BGR), cv2.COLOR_BGR2Lab)
    coloured[..., 1:] = 150
    plain, model = (learnt(coloured, person, 3) for _ in range(2))
    plain.fade(textured=False)
    assert plain.mean[plain.count > 0][:, 0] == pytest.approx(coloured[plain.count > 0][:, 0])
    assert (plain.mean[plain.count > 0][:, 1:] == 128).all()
    model.fade(textured=True)
    assert (model.count[20:40, 30:50] == 0).all()
    lab = gray_lab(gray)
    assert model.contradicted(lab, 1.0).mean() < 0.02

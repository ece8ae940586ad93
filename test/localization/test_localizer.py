# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Synthetic walkers with exact depth; the bars are those of the documents."""

from __future__ import annotations

import dataclasses
import math
from functools import cache

import numpy as np
import pytest

from benchmarks.localization import CAMERAS, locate, true_matches
from benchmarks.synthetic.perspective import PATHS, Walk, film
from gait_segmentation.errors import InputError
from gait_segmentation.geometry import BodyFrame
from gait_segmentation.localization import CameraPose, Localizer, Location
from gait_segmentation.localization.localizer import DEPTH, GROUND, PREDICTED
from gait_segmentation.results import MatchResult

SECONDS = 1.5
NOISE = 0.01


@cache
def walked(walk: str, camera: str) -> list:
    given = PATHS[walk]
    model, pose = CAMERAS[camera]
    return list(true_matches(list(film(Walk(given.at, given.speed, SECONDS), model, pose))))


def jittered(found: list, seed: int = 0) -> list:
    """Put the bodies off by as much as those that are matched: two hundredths of their height."""
    rng = np.random.default_rng(seed)
    moved = []
    for shot, match, mask in found:
        body = match.body
        dy, dh = 0.01 * body.height * rng.standard_normal(2)
        other = BodyFrame(body.center_x, body.center_y + dy, body.height + 2 * dh, body.angle)
        moved.append((shot, dataclasses.replace(match, body=other), mask))
    return moved


@pytest.mark.parametrize('camera', CAMERAS)
@pytest.mark.parametrize('walk', PATHS)
def test_people_are_where_they_are(walk: str, camera: str) -> None:
    for noise, most in ((NOISE, 0.05), (None, 0.20)):
        errors = locate(jittered(walked(walk, camera)), camera, noise)
        assert len(errors.place) == errors.frames
        assert np.median(errors.place) < most
        assert np.median(errors.heading) < math.radians(15)
        if noise:
            assert np.median(errors.speed) < 0.05


def run(found: list, spoil=None, camera: str = 'level', pose: CameraPose | None = None, **match):
    """Locate somebody by depth images spoilt from the middle on; return locations and shots."""
    model, usual = CAMERAS[camera]
    localizer, located = Localizer(), []
    for number, (shot, about, mask) in enumerate(found):
        depth = shot.depth.copy()
        if spoil is not None and number >= len(found) // 2:
            spoil(depth, mask > 0)
        given = dataclasses.replace(about, **match)
        located += localizer.update([given], [mask], model, pose or usual, depth)
    return located


def error(place: Location, shot) -> float:
    return float(np.linalg.norm(place.position - shot.position))


def holes(depth: np.ndarray, seen: np.ndarray) -> None:
    depth[:, ::2] = 0
    depth[::3] = np.nan


def half(depth: np.ndarray, seen: np.ndarray) -> None:
    columns = np.flatnonzero(seen.any(axis=0))
    depth[:, : int(columns.mean())] = np.inf


def through(depth: np.ndarray, seen: np.ndarray) -> None:
    """The wall behind shows through a third of the body."""
    rows = np.flatnonzero(seen.any(axis=1))
    depth[rows[0] : rows[0] + len(rows) // 3] = 9.0


def nothing(depth: np.ndarray, seen: np.ndarray) -> None:
    depth[:] = -1.0


def nearly_nothing(depth: np.ndarray, seen: np.ndarray) -> None:
    depth[:] = np.nan
    rows, columns = np.nonzero(seen)
    depth[rows[::100], columns[::100]] = 3.0


@pytest.mark.parametrize('spoil', [holes, half, through, nothing, nearly_nothing])
def test_depth_that_is_not_valid_moves_nobody(spoil) -> None:
    found = walked('slanting', 'level')
    places = run(found, spoil)
    assert all(error(place, shot) < 0.1 for place, (shot, _, _) in zip(places, found, strict=True))
    sources = {place.source for place in places}
    assert sources == ({DEPTH, PREDICTED} if spoil in (nothing, nearly_nothing) else {DEPTH})


def test_without_depth_for_long_the_ground_says_it_and_without_that_nothing() -> None:
    shot, about, mask = walked('across', 'level')[0]
    (model, pose), localizer = CAMERAS['level'], Localizer()

    def at(second: float, depth, view: CameraPose) -> Location | None:
        given = dataclasses.replace(about, stamp_ns=round(second * 1e9))
        return localizer.update([given], [mask], model, view, depth)[0]

    for number in range(31):
        assert at(1 + number / 30, shot.depth, pose).source == DEPTH
    assert at(2.5, None, pose).source == PREDICTED
    assert at(5.0, None, pose).source == GROUND
    assert at(5.1, None, CameraPose.above_ground(0.0)) is None


def test_depth_alone_needs_no_ground() -> None:
    found = walked('across', 'level')
    places = run(found, pose=CameraPose.above_ground(0.0))
    assert all(error(place, shot) < 0.1 for place, (shot, _, _) in zip(places, found, strict=True))


def test_a_camera_that_moves_along_sees_who_walks() -> None:
    """With a frame that stays, a robot at the walker's side finds their speed, and not 0."""
    shot, about, mask = walked('across', 'level')[0]
    model, pose = CAMERAS['level']
    localizer = Localizer()
    for number in range(30):
        moved = dataclasses.replace(pose, position=np.array([0, number / 30, 1.2]))
        given = dataclasses.replace(about, stamp_ns=10**9 + number * 10**9 // 30)
        (place,) = localizer.update([given], [mask], model, moved, None)
    assert place.speed == pytest.approx(1.0, abs=1e-3)
    assert place.yaw == pytest.approx(math.pi / 2, abs=0.05)
    assert place.step_length == pytest.approx(1 / (2 * about.phase_rate), abs=1e-3)
    assert error(place, shot) < 0.1


def test_heading_is_by_gait_at_first_and_front_and_back_are_told_apart_by_motion() -> None:
    found = walked('slanting', 'level')
    truth = found[0][0]
    first, *_, last = run(found)
    assert math.remainder(first.yaw - truth.yaw, 2 * math.pi) == pytest.approx(0, abs=0.02)
    assert (first.speed, first.step_length) == (None, None)
    assert first.heading_error > last.heading_error
    mirrored = run([(s, dataclasses.replace(m, azimuth=-m.azimuth), d) for s, m, d in found])
    assert math.remainder(mirrored[-1].yaw - truth.yaw, 2 * math.pi) == pytest.approx(0, abs=0.1)
    # Vectors are the camera's: down is y.
    np.testing.assert_allclose(last.up, [0, -1, 0], atol=1e-12)
    assert last.heading @ last.up == pytest.approx(0, abs=1e-12)
    assert np.linalg.eigvalsh(last.covariance).min() > 0
    assert last.stature == pytest.approx(1.75, abs=0.08)


def test_nobody_is_nowhere() -> None:
    shot, about, mask = walked('across', 'level')[0]
    model, pose = CAMERAS['level']
    nobody = MatchResult.nobody(shot.stamp_ns, 0, (1, 1))
    above = dataclasses.replace(about, track_id=2, body=BodyFrame(320.0, 10.0, 100.0))
    located = Localizer().update([nobody, about, above], [mask] * 3, model, pose, None)
    assert [place and place.track_id for place in located] == [None, 1, None]


def test_an_image_of_another_size_than_the_cameras_is_refused() -> None:
    _, about, mask = walked('across', 'level')[0]
    model, pose = CAMERAS['level']
    with pytest.raises(InputError, match='camera_info is of images of 640 x 480'):
        Localizer().update([about], [mask[::2, ::2]], model, pose)

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Synthetic walkers with exact depth; the bars are those of the documents."""

import dataclasses
import math
import re
from functools import cache

import cv2
import numpy as np
import pytest

from benchmarks.synthetic.perspective import CAMERAS, PATHS, Walk, film, locate, true_matches
from gait_segmentation.geometry import BodyFrame
from gait_segmentation.localization import (
    CameraPose,
    LocalizationConfig,
    Localizer,
    Location,
    PinholeCamera,
)
from gait_segmentation.localization.localizer import DEPTH, GROUND, PREDICTED
from gait_segmentation.results import MatchResult
from test.state import remembered

SECONDS = 1.5
NOISE = 0.01


@cache
def walked(walk: str, camera: str) -> list:
    given = PATHS[walk]
    model, pose = CAMERAS[camera]
    short = Walk(given.at, given.speed, SECONDS)
    return list(true_matches(list(film(short, model, pose, painted=False))))


def first() -> tuple:
    """Return the first frame of a walk, what is matched in it, the mask, camera and pose."""
    return *walked('across', 'level')[0], *CAMERAS['level']


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


@pytest.mark.parametrize(
    ('walk', 'camera'), [*((walk, 'level') for walk in PATHS), ('arc', 'high')]
)
def test_people_are_where_they_are(walk: str, camera: str) -> None:
    for noise, most in ((NOISE, 0.05), (None, 0.20)):
        errors = locate(jittered(walked(walk, camera)), camera, noise)
        assert len(errors.place) == errors.frames
        assert np.median(errors.place) < most
        assert np.median(errors.heading) < math.radians(15)
        if noise:
            assert np.median(errors.speed) < 0.05


def run(found: list, spoil=None, pose: CameraPose | None = None) -> list[Location]:
    """Locate somebody by depth images spoilt from the middle on."""
    model, usual = CAMERAS['level']
    localizer, located = Localizer(), []
    for number, (shot, about, mask) in enumerate(found):
        depth = shot.depth.copy()
        if spoil is not None and number >= len(found) // 2:
            spoil(depth, mask > 0)
        located += localizer.update([about], [mask], model, pose or usual, depth)
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


def all_of(value: float):
    def spoil(depth: np.ndarray, seen: np.ndarray) -> None:
        depth[:] = value

    return spoil


NOTHING = all_of(-1.0)


@pytest.mark.parametrize('spoil', [holes, half, through, NOTHING])
def test_depth_that_is_not_valid_moves_nobody(spoil) -> None:
    found = walked('slanting', 'level')
    places = run(found, spoil)
    assert all(error(place, shot) < 0.1 for place, (shot, _, _) in zip(places, found, strict=True))
    sources = {place.source for place in places}
    assert sources == ({DEPTH, PREDICTED} if spoil is NOTHING else {DEPTH})


def test_who_is_gone_is_not_remembered() -> None:
    (shot, about, mask, model, pose), localizer, sizes = first(), Localizer(), set()
    for number in range(1, 6):
        other = dataclasses.replace(about, track_id=number, stamp_ns=number * 10**9)
        assert localizer.update([other], [mask], model, pose, shot.depth)[0] is not None
        sizes.add(len(remembered(localizer)))
    assert len(sizes) == 1


def test_without_depth_for_long_the_ground_says_it_and_without_that_nothing() -> None:
    (shot, about, mask, model, pose), localizer = first(), Localizer()

    def at(second: float, depth, view: CameraPose) -> Location | None:
        given = dataclasses.replace(about, stamp_ns=round(second * 1e9))
        return localizer.update([given], [mask], model, view, depth)[0]

    for number in range(31):
        assert at(1 + number / 30, shot.depth, pose).source == DEPTH
    seen = at(2.01, shot.depth, pose)
    later = at(2.5, None, pose)
    assert later.source == PREDICTED
    assert np.diag(later.covariance).sum() > 1.5 * np.diag(seen.covariance).sum()
    assert at(5.0, None, pose).source == GROUND
    assert at(5.1, None, CameraPose.above_ground(0.0)) is None


def test_what_is_seen_in_a_mirror_is_on_the_other_side_and_when_it_is_does_not_matter() -> None:
    model, pose = CAMERAS['high']
    other = dataclasses.replace(model, cx=model.width - 1 - model.cx)
    one, two = Localizer(), Localizer()
    # It was another walk before, of the same person or another one: nothing of it is left.
    for shot, about, mask in walked('across', 'level'):
        two.update([about], [mask], *CAMERAS['level'], shot.depth)
    side, year_ns = np.array([-1, 1, 1]), 365 * 86_400 * 10**9
    for later_ns, track_id in ((year_ns, 5), (0, 5)):
        for number, (shot, about, mask) in enumerate(jittered(walked('arc', 'high'))):
            body = about.body
            there = BodyFrame(model.width - body.center_x, body.center_y, body.height, -body.angle)
            seen = dataclasses.replace(
                about,
                body=there,
                azimuth=math.pi - about.azimuth,
                stamp_ns=about.stamp_ns + later_ns,
                track_id=track_id,
            )
            # At last by prediction and then by the ground.
            depths = [shot.depth, shot.depth[:, ::-1]] if number < 25 else [None, None]
            (here,) = one.update([about], [mask], model, pose, depths[0])
            (found,) = two.update([seen], [mask[:, ::-1]], other, pose, depths[1])
            # Not the same pixels of a body are looked at.
            np.testing.assert_allclose(found.position, side * here.position, atol=0.02)
            np.testing.assert_allclose(found.heading, side * here.heading, atol=0.05)
            turned = side[:, None] * here.covariance * side
            np.testing.assert_allclose(found.covariance, turned, rtol=0.1, atol=1e-4)
            assert math.remainder(found.yaw + here.yaw, 2 * math.pi) == pytest.approx(0, abs=0.05)
            assert found.source == here.source
            assert (found.speed is None) == (here.speed is None)
            assert (found.speed or 0) == pytest.approx(here.speed or 0, abs=0.02)
        one.reset()


def mixed(depth: np.ndarray, seen: np.ndarray) -> None:
    """At the outline a depth camera mixes what is before and behind."""
    inside = cv2.erode(seen.astype(np.uint8), np.ones((3, 3), np.uint8))
    depth[seen & (inside == 0)] += 0.4


def test_depth_at_the_outline_does_not_count() -> None:
    found = walked('slanting', 'level')
    for spoilt, clean in zip(run(found, mixed), run(found), strict=True):
        np.testing.assert_array_equal(spoilt.position, clean.position)


def alongside(speed: float, stride_rate: float) -> Location:
    """Return where a robot at the side of a walker, whose steps are given, sees them at last."""
    _, about, mask, model, pose = first()
    localizer = Localizer()
    for number in range(30):
        moved = dataclasses.replace(pose, position=np.array([0, speed * number / 30, 1.2]))
        stamp_ns = 10**9 + number * 10**9 // 30
        given = dataclasses.replace(about, stamp_ns=stamp_ns, phase_rate=stride_rate)
        (place,) = localizer.update([given], [mask], model, moved, None)
    return place


def test_a_camera_that_moves_along_sees_who_walks() -> None:
    """With a frame that stays, a robot at the walker's side finds their speed, and not 0."""
    shot, about, *_ = first()
    place = alongside(1.0, about.phase_rate)
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


def test_the_heading_is_that_of_the_motion_that_fits_best_and_its_error_says_how_well() -> None:
    model, pose = CAMERAS['level']
    config = LocalizationConfig(acceleration=0.1)
    localizer, samples, normal, right = Localizer(config), [], np.zeros((6, 6)), np.zeros(6)
    for shot, about, mask in walked('across', 'level'):
        (place,) = localizer.update([about], [mask], model, pose, shot.depth)
        samples.append((about.stamp_ns * 1e-9, place))
    for seconds, each in samples:
        since = seconds - samples[-1][0]
        if since >= -config.window:
            # Place, velocity and an acceleration that is about so large.
            powers = np.array([1, since, since**2 / 2])
            weight = np.linalg.inv((pose.rotation @ each.covariance @ pose.rotation.T)[:2, :2])
            normal += np.kron(np.outer(powers, powers), weight)
            right += np.kron(powers, weight @ (pose.rotation @ each.position)[:2])
    normal[4:, 4:] += np.eye(2) / 0.1**2
    velocity, covariance = np.linalg.solve(normal, right)[2:4], np.linalg.inv(normal)[2:4, 2:4]
    sideways = np.array([-velocity[1], velocity[0]]) / np.linalg.norm(velocity)
    by_motion = velocity @ velocity / (sideways @ covariance @ sideways)
    by_gait = 1 / math.radians(config.gait_error) ** 2
    assert place.heading_error == pytest.approx((by_motion + by_gait) ** -0.5, rel=1e-3)


def test_on_the_ground_the_place_is_as_sure_as_the_angle_of_the_soles() -> None:
    _, about, mask, *_ = first()
    model = PinholeCamera(640, 480, 500.0, 500.0, 320.0, 240.0)
    # The soles are 2 m ahead and 2 m below.
    given = dataclasses.replace(about, body=BodyFrame(320.5, 640.5, 200.0))
    pose = CameraPose.above_ground(2.0)
    (place,) = Localizer(LocalizationConfig(feet_error=0.05)).update([given], [mask], model, pose)
    assert place.position[2] == pytest.approx(2.0)
    angle = 0.05 * 200 / 500
    assert place.covariance[2, 2] ** 0.5 == pytest.approx(angle * (2**2 + 2**2) / 2, rel=1e-3)


@pytest.mark.parametrize('off', [0.0, 1.0])
@pytest.mark.parametrize('grounded', [True, False])
def test_whoever_is_straight_below_the_camera_is_not_located(off: float, grounded: bool) -> None:
    shot, about, mask, model, _ = first()
    down = CameraPose.above_ground(2.0, math.radians(90))
    down = dataclasses.replace(down, grounded=grounded)
    body = BodyFrame(model.cx + 0.5 + off, model.cy + 0.5, 100.0)
    localizer = Localizer()
    given = dataclasses.replace(about, body=body)
    for depth in (None, shot.depth):
        assert localizer.update([given], [mask], model, down, depth) == (None,)
        assert localizer.reasons == ('straight below or above the camera',)
    aside = dataclasses.replace(given, body=BodyFrame(600.0, 300.0, 100.0))
    (place,) = localizer.update([aside], [mask], model, down, None)
    assert (place is not None) == grounded


def test_an_error_that_no_door_refuses_costs_one_person_only() -> None:
    shot, about, mask, model, pose = first()
    other = dataclasses.replace(about, track_id=2, azimuth=math.inf)
    localizer = Localizer()
    located = localizer.update([other, about], [mask] * 2, model, pose, shot.depth)
    assert [place and place.track_id for place in located] == [None, 1]
    assert localizer.reasons == ('ValueError: math domain error', '')
    assert localizer.failures == 1


@pytest.mark.parametrize(
    ('speed', 'stride_rate', 'has'),
    [
        (1.2, 0.8, ('speed', 'step_length')),
        (1.4, 1e300, ('speed',)),
        (1.4, 0.0, ('speed',)),
        (17.0, 2.0, ()),
    ],
)
def test_rate_and_speed_that_no_walker_has_give_no_steps(
    speed: float, stride_rate: float, has: tuple[str, ...]
) -> None:
    """A robot at the side of somebody who stands sees them as fast as itself."""
    place = alongside(speed, stride_rate)
    known = {name for name in ('speed', 'step_length') if getattr(place, name) is not None}
    assert known == set(has)


def part(depth: np.ndarray, seen: np.ndarray) -> None:
    """There is a depth on 15 % of the body."""
    rows, columns = np.nonzero(seen)
    few = rows < np.quantile(rows, 0.85)
    depth[rows[few], columns[few]] = 0


@pytest.mark.parametrize(
    ('spoil', 'why'),
    [(NOTHING, 'no depth on the body'), (part, r'depth on 1\d % of the body only')],
)
def test_it_is_said_why_depth_locates_nobody(spoil, why: str) -> None:
    shot, about, mask, model, _ = first()
    depth, localizer = shot.depth.copy(), Localizer()
    spoil(depth, mask > 0)
    assert localizer.update([about], [mask], model, None, depth) == (None,)
    assert re.match(why, localizer.reasons[0].replace('%', ' %'))
    localizer.reset()
    assert localizer.reasons == ()


def test_it_is_said_why_the_ground_locates_nobody() -> None:
    _, about, mask, model, pose = first()
    above = dataclasses.replace(about, body=BodyFrame(320.0, 10.0, 100.0))
    far = dataclasses.replace(about, body=BodyFrame(320.0, model.cy + 1 - 50, 100.0))
    nobody = MatchResult.empty(about.stamp_ns, 0, (1, 1))
    localizer = Localizer()
    located = localizer.update([above, far, nobody, about], [mask] * 4, model, pose)
    assert [place and place.track_id for place in located] == [None, None, None, 1]
    assert localizer.reasons[0] == 'the soles are at or above the horizon'
    assert 'above localization.max_distance' in localizer.reasons[1]
    assert localizer.update([about], [mask], model) == (None,)
    assert localizer.reasons == ('neither a depth image nor the ground says where',)


@pytest.mark.parametrize('pitch', [0.0, 20.0])
@pytest.mark.parametrize('height', [0.0, 2.2])
def test_the_distance_is_that_on_the_ground_where_the_camera_is_known(
    pitch: float, height: float
) -> None:
    """The place of somebody to the side, 2.2 m below the camera."""
    model = PinholeCamera(640, 480, 500.0, 500.0, 320.0, 240.0)
    pose = CameraPose.above_ground(height, math.radians(pitch))
    wanted = np.array([4.0, -2.0, height - 2.2])
    ahead = (wanted - pose.position) @ pose.rotation
    x, y = 500 * ahead[:2] / ahead[2] + 240.5 + np.array([80, 0])
    top = (wanted + np.array([0, 0, 1.7]) - pose.position) @ pose.rotation
    up = 500 * top[1] / top[2] + 240.5
    _, about, _ = walked('across', 'level')[0]
    body = BodyFrame(x, (y + up) / 2, y - up)
    mask = np.zeros((480, 640), np.uint8)
    mask[int(up) + 1 : int(y), int(x) - 10 : int(x) + 10] = 255
    depth = np.full(mask.shape, ahead[2], np.float32)
    given = dataclasses.replace(about, body=body)
    (place,) = Localizer().update([given], [mask], model, pose, depth)
    level = place.position - place.position @ place.up * place.up
    if height or pitch:
        assert place.distance == pytest.approx(np.linalg.norm(level))
        assert place.distance < np.linalg.norm(place.position) - 0.2
    else:
        assert place.distance == place.position[2]


def test_who_leans_is_where_the_soles_are_and_the_pitch_of_the_camera_is_in_degrees() -> None:
    """Without a pose the camera is as configured; the head is to the right of the soles."""
    model = PinholeCamera(640, 480, 500.0, 500.0, 320.0, 240.0)
    config = LocalizationConfig(camera_height=2.0, camera_pitch=20.0)
    wanted, top = np.array([4.0, 0.5, 0.0]), np.array([4.0, 0.0, 1.7])
    pose = CameraPose.above_ground(2.0, math.radians(20))
    ends = [(at - pose.position) @ pose.rotation for at in (wanted, top)]
    soles, head = (500 * end[:2] / end[2] + (320.5, 240.5) for end in ends)
    across, down = soles - head
    middle = (soles + head) / 2
    body = BodyFrame(*middle, math.hypot(across, down), math.atan2(-across, down))
    _, about, mask, *_ = first()
    given = dataclasses.replace(about, body=body)
    (place,) = Localizer(config).update([given], [mask], model)
    np.testing.assert_allclose(place.position, ends[0], atol=1e-6)

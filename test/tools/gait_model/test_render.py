# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings, strategies as st

from gait_segmentation.errors import BankError
from gait_tools.gait_model.body import BUILDS, PARTS, Body, Build
from gait_tools.gait_model.render import (
    draw,
    extent,
    hull_outline,
    project,
    register,
    render_cycle,
    render_parts,
    render_silhouette,
    view_matrix,
)
from gait_tools.gait_model.skeleton import Frame

PHASES = np.arange(12) / 12


def tanimoto(first, second):
    return np.minimum(first, second).sum() / np.maximum(first, second).sum()


@pytest.mark.parametrize('azimuth', [0.0, np.pi])
def test_half_cycles_look_alike_in_profile(azimuth):
    cycle = render_cycle(PHASES, azimuth)
    for phase in range(6):
        assert tanimoto(cycle[phase].astype(int), cycle[phase + 6].astype(int)) > 0.93


def test_oblique_views_tell_the_half_cycles_apart():
    cycle = render_cycle(PHASES, np.pi / 4).astype(int)
    assert tanimoto(cycle[0], cycle[6]) < 0.9


@pytest.mark.parametrize('azimuth', [0.0, 0.7, -1.2])
def test_a_mirrored_view_is_the_mirrored_walker_half_a_stride_later(azimuth):
    cycle = render_cycle(PHASES, azimuth).astype(int)
    other = render_cycle(PHASES + 0.5, np.pi - azimuth)[:, :, ::-1].astype(int)
    assert tanimoto(cycle, other) > 0.97


@pytest.mark.parametrize('name', sorted(BUILDS))
@pytest.mark.parametrize('azimuth', [0.0, 1.2])
def test_registration(name, azimuth):
    height, width, fill = 96, 64, 0.9
    cycle = render_cycle(PHASES, azimuth, build=name, grid=(height, width), fill=fill)
    inside = cycle >= 128
    tops = [np.flatnonzero(m.any(axis=1))[0] for m in inside]
    bottoms = [np.flatnonzero(m.any(axis=1))[-1] + 1 for m in inside]
    assert np.mean(bottoms) - np.mean(tops) == pytest.approx(fill * height, abs=1.5)
    assert (np.mean(bottoms) + np.mean(tops)) / 2 == pytest.approx(height / 2, abs=1.0)
    assert np.ptp(tops) <= 4
    mass = np.cumsum(cycle.sum(axis=1, dtype=float), axis=1)
    medians = [np.interp(m[-1] / 2, m, np.arange(1, width + 1)) for m in mass]
    assert np.mean(medians) == pytest.approx(width / 2, abs=0.7)
    # Nothing is cut off.
    assert not cycle[:, 0].any()
    assert not cycle[:, -1].any()
    assert cycle[:, :, [0, -1]].max() < 128


def test_edges_are_soft_and_the_inside_is_full():
    image = render_silhouette(0.1, 0.0, 100.0)
    assert image.dtype == np.uint8
    assert image.max() == 255
    assert 10 < len(np.unique(image)) <= 17


def test_size_and_ground_of_a_single_picture():
    image = render_silhouette(0.3, 0.0, 90.0, fill=0.9)
    assert image.shape == (100, 72)
    rows = np.flatnonzero((image >= 128).any(axis=1))
    assert rows[-1] + 1 == pytest.approx(50 + 45, abs=1)
    moved = render_silhouette(0.3, 0.0, 90.0, fill=0.9, shift=(2.0, -3.0))
    assert (moved[:-3, 2:] == image[3:, :-2]).all()


def test_size_of_the_picture_does_not_change_the_shape():
    small = render_silhouette(0.2, 0.5, 60.0).sum() / 60**2
    large = render_silhouette(0.2, 0.5, 240.0).sum() / 240**2
    assert small == pytest.approx(large, rel=0.01)


@pytest.mark.parametrize('azimuth', [0.0, np.pi / 2, -np.pi / 2])
def test_parts_add_up_to_the_silhouette(azimuth):
    kwargs = {'build': Build(hem=0.25, rucksack=0.1)}
    parts = render_parts(0.1, azimuth, 120.0, **kwargs)
    whole = render_silhouette(0.1, azimuth, 120.0, **kwargs).astype(int)
    assert tuple(parts) == PARTS
    total = sum(part.astype(int) for part in parts.values())
    assert np.abs(total - whole).max() <= len(PARTS) / 2


def test_a_rucksack_is_seen_from_behind_and_not_from_the_front():
    behind = render_parts(0.1, np.pi / 2, 120.0, build='rucksack')['rucksack'].sum(dtype=int)
    front = render_parts(0.1, -np.pi / 2, 120.0, build='rucksack')['rucksack'].sum(dtype=int)
    assert behind > 10 * front


def test_heads_are_above_feet():
    parts = render_parts(0.0, 0.4, 120.0)
    row = {
        name: np.average(np.arange(len(a)), weights=a.sum(axis=1, dtype=float) + 1e-9)
        for name, a in parts.items()
    }
    assert row['head'] < row['torso'] < row['legs'] < row['feet']


def test_registration_is_kept():
    assert register(Build(), (0.0, 0.0)) is register(Build(), (0.0, 0.0))


def test_bad_input():
    with pytest.raises(BankError, match=r'height_px must be a positive number.*got -3'):
        render_silhouette(0.0, 0.0, -3.0)
    with pytest.raises(BankError, match=r'fill must be in \(0, 1\], got 2'):
        render_silhouette(0.0, 0.0, 30.0, fill=2)
    with pytest.raises(BankError, match='build must be one of'):
        render_cycle([0.0], 0.0, build='nobody')


angles = st.floats(-4, 4)


@given(angles, st.floats(-1, 1))
def test_views_are_rigid(azimuth, elevation):
    view = view_matrix(azimuth, elevation)
    assert view @ view.T == pytest.approx(np.eye(3), abs=1e-9)


@pytest.mark.parametrize(
    ('azimuth', 'right', 'away'),
    [(0, 1, 0), (np.pi / 2, 0, 1), (np.pi, -1, 0), (-np.pi / 2, 0, -1)],
)
def test_azimuth_is_the_walking_direction(azimuth, right, away):
    forward = view_matrix(azimuth) @ (1, 0, 0)
    assert forward == pytest.approx((right, 0, away), abs=1e-12)


def test_the_left_hand_is_on_the_left_of_somebody_walking_away():
    assert (view_matrix(np.pi / 2) @ (0, 1, 0))[0] == pytest.approx(-1)


def test_up_is_up_and_a_camera_looking_down_sees_the_head_nearer():
    down, away = (view_matrix(0.0, 0.3) @ (0, 0, 1))[1:]
    assert down < 0
    assert away < 0


def test_extent_of_a_ball_and_a_disc():
    body, axes = Body(), np.eye(3)[:, None]
    level = Frame(along=axes[2], front=axes[1], left=axes[0])
    ball = body.ellipsoid(np.array([[0.0, 0.0, 2.0]]), level, 0.5, 0.5, 0.5)
    disc = body.ellipsoid(np.array([[3.0, 0.0, 0.0]]), level, 0.25, 0.25)
    body.hull('head', ball, disc)
    centers, axes, away = project(body, (0.0, 0.0))
    left, top, right, bottom = extent(centers, axes)
    assert (left[0], right[0]) == pytest.approx((-0.5, 3.25))
    assert (top[0], bottom[0]) == pytest.approx((-2.5, 0.0))
    assert away == pytest.approx(np.zeros((1, 2)))


CORNERS = 96


def ellipse(width, height):
    axes = np.zeros((1, 2, 3))
    axes[0, 0, 0], axes[0, 1, 1] = width, height
    return axes


def outline_of(centers, axes, members, count=4):
    angles = 2 * np.pi * np.arange(count) / count
    outline = np.empty((count, 2))
    hull_outline(centers, axes, np.array(members), np.cos(angles), np.sin(angles), outline)
    return outline


def test_outline_of_an_ellipse_touches_its_axes():
    found = outline_of(np.array([[10.0, 5.0]]), ellipse(4.0, 2.0), [0])
    assert found == pytest.approx(np.array([[14, 5], [10, 7], [6, 5], [10, 3]]), abs=1e-9)


def test_outline_of_a_hull_takes_the_member_that_reaches_farthest():
    axes = np.concatenate([ellipse(1.0, 1.0), ellipse(2.0, 2.0)])
    found = outline_of(np.array([[0.0, 0.0], [8.0, 0.0]]), axes, [0, 1])
    assert found[:, 0] == pytest.approx([10, 8, -1, 8], abs=1e-9)


def inside(outline, shape):
    """Return which pixels have their centre inside of a convex outline."""
    rows, columns = np.indices(shape) + 0.5
    along = np.roll(outline, -1, axis=0) - outline
    across = [
        dx * (rows - y) - dy * (columns - x)
        for (x, y), (dx, dy) in zip(outline, along, strict=True)
    ]
    return np.min(across, axis=0) > 0


shapes = given(st.floats(4, 28), st.floats(0.4, 1.0), st.floats(30, 34), st.floats(30, 34))


@shapes
@example(5.5, 1.0, 32.0, 32.0)
@settings(max_examples=50)
def test_pixels_are_set_where_their_centre_lies_inside(size, ratio, x, y):
    centers, axes = np.array([[x, y]]), ellipse(size, ratio * size)
    canvas = draw((64, 64), centers, axes, [(0,)], [1])
    outline = outline_of(centers, axes, [0], CORNERS)
    # A centre on the outline itself is on either side of it, as the last bit has it.
    least, most = (
        inside(centers + (outline - centers) * by, canvas.shape) for by in (1 - 1e-9, 1 + 1e-9)
    )
    assert not (least & (canvas == 0)).any()
    assert not (~most & (canvas == 1)).any()


@shapes
@example(5.5, 1.0, 32.0, 32.0)
@settings(max_examples=50)
def test_area_is_neither_grown_nor_shrunk(size, ratio, x, y):
    """
    Areas hold on average over all places within a pixel.

    At one place they need not: of a disc of radius 5.5 about the corner of a pixel 88 centres lie
    inside, 7 less than its area.  What holds is that a convex figure of area A and perimeter P
    has A - P / 2 to A + P / 2 + 1 points of the unit grid inside (Nosarzewska 1948).  The places
    at steps of 1 / n together make a grid n times as fine, on which the same says that the mean
    is within P / 2n + 1 / n^2 of A.
    """
    steps = 8
    width, height = size, ratio * size
    count = 0
    for place in np.ndindex(steps, steps):
        center = np.array([[x, y]]) + np.array(place) / steps
        count += int(draw((64, 64), center, ellipse(width, height), [(0,)], [1]).sum())
    area = np.pi * width * height
    # The outline is inscribed.  Between corners that are t apart as angles of the ellipse it
    # leaves out width * height * (t - sin t) / 2, at most t^3 / 12 of width * height.
    apart = 2 * np.pi / CORNERS / ratio
    left_out = area * apart**2 / 6
    perimeter = np.pi * np.sqrt(2 * (width**2 + height**2))  # at most
    error = count / steps**2 - area
    assert -left_out - perimeter / (2 * steps) <= error
    assert error <= perimeter / (2 * steps) + 1 / steps**2


def test_what_lies_outside_of_the_canvas_is_left_out():
    for x, y in ((-50.0, 4.0), (50.0, 4.0), (4.0, -50.0), (4.0, 50.0)):
        assert not draw((8, 8), np.array([[x, y]]), ellipse(3.0, 3.0), [(0,)], [1]).any()
    assert draw((8, 8), np.array([[4.0, 4.0]]), ellipse(100.0, 100.0), [(0,)], [1]).all()


def test_later_pieces_cover_earlier_ones():
    centers = np.array([[4.5, 4.5], [4.5, 4.5]])
    axes = np.concatenate([ellipse(4.0, 4.0), ellipse(1.0, 1.0)])
    canvas = draw((9, 9), centers, axes, [(0,), (1,)], [3, 7])
    assert canvas[4, 4] == 7
    assert canvas[4, 1] == 3

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.geometry import BodyFrame, Box, Placement
from gait_segmentation.results import MatchResult
from gait_segmentation.starting.finding.gait import Shape, measures_of, person_box
from gait_tools.gait_model import render_silhouette

BODY = BodyFrame(80.0, 60.0, 90.0)


def scene(shape: np.ndarray) -> np.ndarray:
    """Return (120, 160) uint8 with a silhouette about the body's place."""
    out = np.zeros((120, 160), np.uint8)
    top, left = 60 - shape.shape[0] // 2, 80 - shape.shape[1] // 2
    out[top : top + shape.shape[0], left : left + shape.shape[1]] = shape
    return out


def walker(phase: float, azimuth: float = 0.0) -> np.ndarray:
    return scene(render_silhouette(phase, azimuth, 90))


def match(prior: np.ndarray) -> MatchResult:
    place = Placement(0.0, 0.0, 1.0)
    return MatchResult(1, 1, BODY, place, 0, 0, 0.0, 0.9, 0.0, 0.8, 0.9, prior)


def shape(likelihood: np.ndarray, template: np.ndarray) -> Shape:
    return Shape.of(likelihood, match(template))


def test_the_legs_of_a_walker_swing_and_the_trunk_does_not() -> None:
    shapes = [walker(0.06 * step) for step in range(9)]
    gait = measures_of([shape(each, each) for each in shapes])
    assert gait['swing'] > 0.4
    assert gait['swing'] > 2 * gait['trunk']
    assert gait['similarity'] == pytest.approx(match(walker(0.0)).similarity)
    assert gait['plain'] < 0
    assert gait['rigid'] < 0


def test_legs_agree_with_templates_that_step_as_they_do() -> None:
    walking = [walker(0.06 * step) for step in range(9)]
    late = [walker(0.06 * step + 0.25) for step in range(9)]
    assert measures_of([shape(each, each) for each in walking])['accord'] > 0.9
    pairs = zip(walking, late, strict=True)
    assert measures_of([shape(each, template) for each, template in pairs])['accord'] < 0.2
    assert measures_of([shape(each, walking[0]) for each in walking])['accord'] == 0


def test_a_rigid_figure_that_is_matched_now_here_now_there_does_not_swing() -> None:
    figure, template = walker(0.0), walker(0.0)
    shaken = [np.roll(figure, 5 * (step % 2), axis=1) for step in range(6)]
    gait = measures_of([shape(each, template) for each in shaken])
    assert gait['swing'] < 0.15


def test_legs_that_the_border_hides_at_times_do_not_swing() -> None:
    figure = walker(0.0)
    shapes = []
    for step in range(6):
        cut = np.ascontiguousarray(figure[: 100 - 4 * step])
        shapes.append(shape(cut, np.ascontiguousarray(walker(0.0)[: len(cut)])))
    gait = measures_of(shapes)
    assert gait['swing'] < 0.1


@pytest.mark.parametrize('phase', [0.0, 0.25])
def test_a_figure_on_wheels_does_not_swing(phase: float) -> None:
    gait = measures_of([shape(walker(phase), walker(phase))] * 8)
    assert gait['swing'] == gait['trunk'] == 0


def test_what_stays_as_it_is_while_templates_walk_is_rigid() -> None:
    stiff = scene(np.full((90, 30), 255, np.uint8))
    walking = [walker(0.06 * step) for step in range(9)]
    gait = measures_of([shape(stiff, template) for template in walking])
    assert gait['rigid'] > 0.3


@pytest.mark.parametrize('swings', [True, False])
def test_a_shadow_beside_the_legs_makes_nobody_rigid(swings: bool) -> None:
    front = np.pi / 2
    walking = [walker(0.06 * step, front) for step in range(9)]
    legs = walking if swings else [np.full_like(walking[0], 255)] * len(walking)
    shapes = []
    for body, template in zip(legs, walking, strict=True):
        shadowed = body.copy()
        shadowed[62:108, 95:118] = 255
        shapes.append(shape(shadowed, template))
    assert (measures_of(shapes)['rigid'] < 0.05) == swings


def test_rectangles_and_ellipses_are_plain() -> None:
    box = np.zeros((120, 160), np.uint8)
    box[15:105, 60:100] = 255
    rows, columns = np.mgrid[:120, :160]
    oval = np.where(((rows - 60) / 45) ** 2 + ((columns - 80) / 18) ** 2 < 1, 255, 0)
    assert shape(box, box).plain > 0.9
    assert shape(oval.astype(np.uint8), box).plain > 0.9
    assert shape(np.zeros_like(box), box).plain == 0


def test_the_box_is_tight_about_what_moves_at_the_template() -> None:
    moving = walker(0.0)
    truth = Box.around(moving > 127)
    assert truth is not None
    moving[20:40, 130:150] = 255
    box, cover = person_box(moving, match(walker(0.0)))
    assert box is not None
    assert box.iou(truth) > 0.85
    assert cover > 0.95


def test_what_the_template_does_not_cover_counts_against_it() -> None:
    broad = np.zeros((120, 160), np.uint8)
    broad[10:110, 40:120] = 255
    _, cover = person_box(broad, match(walker(0.25)))
    assert cover < 0.7


def test_nothing_has_no_box() -> None:
    nothing = np.zeros((120, 160), np.uint8)
    assert person_box(nothing, match(walker(0.0))) == (None, 0.0)

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.geometry import Box
from gait_segmentation.starting.first_scene import (
    FirstScene,
    barrier_distance,
    barrier_logit,
    first_scene,
)
from gait_segmentation.starting.hypotheses import VIEWS, Hypothesis, fit_view
from test.walkers import small_bank

BOX = Box(20, 10, 40, 100)


def scene() -> FirstScene:
    """Return a window with somebody dark in the left half of the box, before something light."""
    lab = np.full((120, 80, 3), 200, np.uint8)
    lab[10:110, 20:40] = 60
    return first_scene(lab, BOX, None)


def test_colours_decide_by_what_they_were_learnt_from() -> None:
    found = scene()
    person = np.zeros(found.shape, np.float32)
    person[30:90, 25:35] = 1
    logit = found.logit(person, 1 - person, 0.3)
    assert logit[50, 22] > 0 > logit[50, 50]
    assert np.abs(logit).max() <= 4
    swapped = found.logit(1 - person, person, 0.3)
    assert swapped == pytest.approx(-logit), 'what was learnt before is forgotten'


def test_a_mask_that_touches_all_sides_of_the_box_has_no_gap() -> None:
    found = scene()
    labels = np.zeros(found.shape, np.bool_)
    assert found.gap(labels) == 1
    labels[11:110, 20:59] = True
    assert found.gap(labels) == 0, 'within what a given box may be off'
    labels[:, 40:] = False
    assert found.gap(labels) == pytest.approx(0.5 - 0.03)
    labels[:60] = False
    assert found.gap(labels) == pytest.approx(1 - 2 * 0.03)


def striped() -> tuple[np.ndarray, np.ndarray]:
    """Return a wall with a stripe that runs into the box, a person in it, and the box."""
    image = np.full((60, 80, 3), 100, np.uint8)
    image[30:34] = 160
    image[10:50, 35:45] = (60, 140, 120)
    inside = np.zeros((60, 80), np.bool_)
    inside[8:52, 30:50] = True
    return image, inside


def test_what_runs_into_the_box_is_near_and_the_person_is_far() -> None:
    image, inside = striped()
    distance = barrier_distance(image, inside)
    assert distance[20, 31] == 0
    assert distance[31, 32] == 0
    assert distance[25, 40] == 40 + 40 + 20
    assert not distance[~inside].any()


def test_the_distance_is_the_least_range_over_paths() -> None:
    # One channel, one row: the way from the left climbs to 90, that from the right to 50.
    image = np.repeat(np.array([[10, 90, 40, 50, 10]], np.uint8)[:, :, None], 3, axis=2)
    inside = np.array([[False, True, True, True, False]])
    assert barrier_distance(image, inside)[0].tolist() == [0, 240, 120, 120, 0]


def test_the_evidence_is_signed_limited_and_only_inside() -> None:
    image, inside = striped()
    logit = barrier_logit(image, inside)
    assert logit[25, 40] == pytest.approx(2)
    assert logit[20, 32] == pytest.approx(-2)
    assert not logit[~inside].any()


@pytest.mark.parametrize('value', [True, False])
def test_a_box_that_is_everything_or_nothing_says_nothing(value: bool) -> None:
    image, _ = striped()
    assert not barrier_logit(image, np.full((60, 80), value)).any()


SHAPE = (120, 90)


def fit(
    box: Box, top: bool = False, bottom: bool = False, left: bool = False, right: bool = False
) -> list:
    cuts = (top, bottom, left, right)
    return [fit_view(small_bank(), box, SHAPE, cuts, view) for view in VIEWS]


def laid(hypothesis: Hypothesis) -> np.ndarray:
    """Return the templates in the whole window."""
    whole = np.zeros((len(hypothesis.templates), *SHAPE), np.uint8)
    whole[(slice(None), *hypothesis.part)] = hypothesis.templates
    return whole


def test_templates_fill_the_box() -> None:
    box = Box(25, 10, 40, 100)
    for hypothesis in fit(box):
        for template in laid(hypothesis):
            extent = Box.around(template > 127)
            assert extent.y == pytest.approx(10, abs=1.5)
            assert extent.bottom == pytest.approx(110, abs=1.5)
            assert extent.center_x == pytest.approx(45, abs=1.5)


def test_nothing_of_a_template_is_beyond_the_part_kept() -> None:
    hypothesis = fit(Box(25, 10, 40, 100))[0]
    rows, columns = hypothesis.part
    assert hypothesis.templates.shape[1:] == (rows.stop - rows.start, columns.stop - columns.start)
    # The rim is black already, and little more than that is kept.
    whole = laid(hypothesis).max(axis=0)
    for axis, part in ((1, rows), (0, columns)):
        used = np.flatnonzero(whole.max(axis=axis))
        assert part.start < used[0] <= part.start + 3
        assert part.stop - 3 <= used[-1] + 1 < part.stop


def test_stretching_is_limited_and_unlikely_aspects_weigh_little() -> None:
    wide = fit(Box(5, 10, 80, 100))[2]
    assert wide.azimuth == pytest.approx(np.pi / 2)
    assert wide.weight.max() < 0.2
    for template in laid(wide):
        extent = Box.around(template > 127)
        assert extent.width < 75


def test_at_the_lower_border_taller_bodies_are_tried() -> None:
    box = Box(25, 60, 30, 60)
    plain, cut = fit(box)[0], fit(box, bottom=True)[0]
    assert len(cut.templates) > len(plain.templates)
    assert cut.height.max() == pytest.approx(2.8 * plain.height.max(), rel=0.01)
    assert np.allclose(cut.top, 60)


def test_at_the_upper_border_bodies_reach_up() -> None:
    cut = fit(Box(25, 0, 30, 60), top=True)[0]
    assert cut.top.min() == pytest.approx(-1.8 * 60)


@pytest.mark.parametrize('left', [True, False])
def test_at_a_side_bodies_go_on_beyond_the_border(left: bool) -> None:
    # Half of somebody seen from the front.
    box = Box(0 if left else 75, 10, 15, 100)
    hypothesis = fit(box, left=left, right=not left)[2]
    # But not if nearly nothing of them would be in the image.
    sliver = Box(0 if left else 86, 10, 4, 100)
    assert fit(sliver, left=left, right=not left)[0].weight.max() < 0.1
    beyond = hypothesis.axis < 4 if left else hypothesis.axis > SHAPE[1] - 4
    assert hypothesis.weight[beyond].max() == hypothesis.weight.max()
    for template in laid(hypothesis)[beyond]:
        extent = Box.around(template > 127)
        assert (extent.right if left else extent.x) == pytest.approx(15 if left else 75, abs=2)


def test_leaning_templates_fill_the_box_and_keep_their_height() -> None:
    # A body of 100 pixels that leans by 0.35 is lower than 100 and wider than upright.
    box = Box(20, 12, 55, 96)
    upright, leaning = (
        fit_view(small_bank(), box, SHAPE, (False,) * 4, 0.0, angle) for angle in (0.0, 0.35)
    )
    assert leaning.angle == pytest.approx(0.35)
    assert upright.angle == 0
    extents = [Box.around(template > 127) for template in laid(leaning)]
    best = extents[int(leaning.weight.argmax())]
    assert best.y == pytest.approx(12, abs=1.5)
    assert best.bottom == pytest.approx(108, abs=1.5)
    # The head leans to the right, as the sign says.
    template = laid(leaning)[int(leaning.weight.argmax())] > 127
    head, feet = np.nonzero(template[12:30])[1].mean(), np.nonzero(template[85:108])[1].mean()
    assert head > feet + 15


WINDOW = (30, 20)
PART = (slice(4, 24), slice(3, 15))


def hypothesis() -> tuple[Hypothesis, np.ndarray]:
    """Return a hypothesis of three templates and these in the whole window."""
    rng = np.random.default_rng(1)
    whole = np.zeros((3, *WINDOW), np.uint8)
    whole[(slice(None), *PART)] = rng.integers(0, 256, (3, 20, 12))
    own = np.ascontiguousarray(whole[(slice(None), *PART)])
    numbers = np.ones(3, np.float32)
    return Hypothesis(0.0, 0.0, PART, own, numbers, numbers, numbers, numbers), whole


def test_similarity_counts_the_whole_window() -> None:
    laid, whole = hypothesis()
    likelihood = np.random.default_rng(2).random(WINDOW).astype(np.float32)
    image = np.round(255 * likelihood)
    expected = [np.minimum(each, image).sum() / np.maximum(each, image).sum() for each in whole]
    assert laid.similarities(likelihood) == pytest.approx(expected, rel=1e-5)
    assert laid.similarities(whole[1] / np.float32(255))[1] == 1


def test_the_average_is_weighted_and_blurred() -> None:
    laid, whole = hypothesis()
    mean = laid.average(np.array([1, 3, 0], np.float32), WINDOW, 0.0)
    expected = (whole[0] + 3.0 * whole[1]) / 4 / 255
    assert mean.shape == WINDOW
    assert np.abs(mean - expected).max() < 0.02
    blurred = laid.average(np.array([1, 3, 0], np.float32), WINDOW, 2.0)
    assert blurred.std() < 0.9 * mean.std()
    assert blurred.sum() == pytest.approx(mean.sum(), rel=0.02)

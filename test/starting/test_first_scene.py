# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from gait_segmentation.geometry import Box
from gait_segmentation.starting.first_scene import FirstScene, barrier_distance, first_scene
from gait_segmentation.starting.hypotheses import VIEWS, Hypothesis, fit_view
from test.walkers import small_bank

BOX = Box(20, 10, 40, 100)


def scene() -> FirstScene:
    """Return a window with somebody dark in the left half of the box, before something light."""
    lab = np.full((120, 80, 3), 200, np.uint8)
    lab[10:110, 20:40] = 60
    return first_scene(lab, BOX, None)


def test_beside_the_box_only_what_is_known_to_stand_out_may_be_the_person() -> None:
    known = np.zeros((120, 80), np.float32)
    known[111, 25:35] = 3
    inside = first_scene(scene().lab, BOX, known).inside
    assert np.flatnonzero(inside[111]).tolist() == list(range(25, 35))


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


def test_the_distance_is_the_least_range_over_paths() -> None:
    # One channel, one row: the way from the left climbs to 90, that from the right to 50.
    image = np.repeat(np.array([[10, 90, 40, 50, 10]], np.uint8)[:, :, None], 3, axis=2)
    inside = np.array([[False, True, True, True, False]])
    assert barrier_distance(image, inside)[0].tolist() == [0, 240, 120, 120, 0]


SHAPE = (120, 90)


def fit(box: Box, *cuts: str) -> list[Hypothesis]:
    """Lay templates onto a box, of which sides are cut by the border of the image."""
    cut = tuple(side in cuts for side in ('top', 'bottom', 'left', 'right'))
    return [fit_view(small_bank(), box, SHAPE, cut, view) for view in VIEWS]


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


def test_at_the_lower_border_taller_bodies_are_tried() -> None:
    box = Box(25, 60, 30, 60)
    plain, cut = fit(box)[0], fit(box, 'bottom')[0]
    assert len(cut.templates) > len(plain.templates)
    assert cut.height.max() == pytest.approx(2.8 * plain.height.max(), rel=0.01)
    assert np.allclose(cut.top, 60)
    # Between both borders as if below.
    assert np.allclose(fit(Box(25, 0, 30, 120), 'top', 'bottom')[0].top, 0)


@pytest.mark.parametrize('left', [True, False])
def test_at_a_side_bodies_go_on_beyond_the_border(left: bool) -> None:
    # Half of somebody seen from the front.
    box = Box(0 if left else 75, 10, 15, 100)
    hypothesis = fit(box, 'left' if left else 'right')[2]
    # But not if nearly nothing of them would be in the image.
    sliver = Box(0 if left else 86, 10, 4, 100)
    assert fit(sliver, 'left' if left else 'right')[0].weight.max() < 0.1
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

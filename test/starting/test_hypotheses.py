# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from functools import partial

import numpy as np
import pytest

from gait_segmentation.geometry import Box
from gait_segmentation.starting.hypotheses import VIEWS, Hypothesis, lay_onto
from test.walkers import small_bank

SHAPE = (120, 90)


def fit(box: Box, *cuts: str) -> list[Hypothesis]:
    """Lay templates onto a box, of which sides are cut by the border of the image."""
    cut = tuple(side in cuts for side in ('top', 'bottom', 'left', 'right'))
    return [lay_onto(box, small_bank(), SHAPE, cut, view) for view in VIEWS]


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
    assert beyond.any()
    assert hypothesis.weight[beyond].max() == hypothesis.weight.max()
    for template in laid(hypothesis)[beyond]:
        extent = Box.around(template > 127)
        assert (extent.right if left else extent.x) == pytest.approx(15 if left else 75, abs=2)


def test_leaning_templates_fill_the_box_and_keep_their_height() -> None:
    # A body of 100 pixels that leans by 0.35 is lower than 100 and wider than upright.
    box = Box(20, 12, 55, 96)
    upright, leaning = (
        lay_onto(box, small_bank(), SHAPE, (False,) * 4, 0.0, angle) for angle in (0.0, 0.35)
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


def test_templates_are_laid_onto_the_box_as_its_borders_and_its_room_say() -> None:
    box, shape = Box(60, 20, 50, 60), (100, 160)
    laid = partial(lay_onto, box, small_bank(), shape, view=0.0)
    nowhere, both = (False,) * 4, (True, True, False, False)
    assert laid(cuts=both).top == pytest.approx(box.y)
    assert laid(cuts=(True, False, False, False)).top.min() < box.y - 10
    left, right = (laid(cuts=nowhere, aside=side).axis.mean() for side in (-1.0, 1.0))
    assert left < right - 5
    whole = laid(cuts=nowhere)
    likelihood = np.zeros(shape, np.float32)
    likelihood[whole.part] = whole.templates[0] / np.float32(255)
    assert whole.similarities(likelihood)[0] == pytest.approx(1)

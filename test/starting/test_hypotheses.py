# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from gait_segmentation.geometry import Box
from gait_segmentation.starting.hypotheses import VIEWS, Hypothesis, lay_onto
from test.walkers import small_bank

SHAPE = (120, 90)


def fit(box: Box, *cuts: str, view: float = 0.0, **options) -> Hypothesis:
    """Lay templates onto a box, of which sides are cut by the border of the image."""
    cut = tuple(side in cuts for side in ('top', 'bottom', 'left', 'right'))
    return lay_onto(box, small_bank(), SHAPE, cut, view, **options)


@pytest.mark.parametrize('view', VIEWS)
def test_templates_fill_the_box(view: float) -> None:
    for template in fit(Box(25, 10, 40, 100), view=view).templates:
        extent = Box.around(template > 127)
        assert extent.y == pytest.approx(10, abs=1.5)
        assert extent.bottom == pytest.approx(110, abs=1.5)
        assert extent.center_x == pytest.approx(45, abs=1.5)


@pytest.mark.parametrize(
    ('cuts', 'top'), [((), 30), (('bottom',), 30), (('top', 'bottom'), 30), (('top',), -30)]
)
def test_a_taller_body_goes_on_below_unless_only_the_upper_border_cuts_it(
    cuts: tuple[str, ...], top: float
) -> None:
    for body in fit(Box(25, 30, 30, 60), *cuts, taller=2.0).bodies:
        assert body.height == pytest.approx(120, rel=0.05)
        assert body.center_y - body.height / 2 == pytest.approx(top, abs=4)


@pytest.mark.parametrize('left', [True, False])
def test_at_a_side_a_body_goes_on_beyond_the_border(left: bool) -> None:
    # Half of somebody seen from the front.
    box = Box(0 if left else 75, 10, 15, 100)
    hypothesis = fit(box, 'left' if left else 'right', view=np.pi / 2, beyond=True)
    assert hypothesis.weight.max() == 1
    for template, body in zip(hypothesis.templates, hypothesis.bodies, strict=True):
        assert body.center_x < 4 if left else body.center_x > SHAPE[1] - 4
        extent = Box.around(template > 127)
        assert (extent.right if left else extent.x) == pytest.approx(15 if left else 75, abs=2)


def test_leaning_templates_fill_the_box_and_keep_their_height() -> None:
    # A body of 100 pixels that leans by 0.35 is lower than 100 and wider than upright.
    leaning = fit(Box(20, 12, 55, 96), angle=0.35)
    best = int(leaning.weight.argmax())
    assert leaning.bodies[best].angle == pytest.approx(0.35)
    assert leaning.bodies[best].height == pytest.approx(100, rel=0.05)
    template = leaning.templates[best] > 127
    extent = Box.around(template)
    assert extent.y == pytest.approx(12, abs=1.5)
    assert extent.bottom == pytest.approx(108, abs=1.5)
    # The head leans to the right, as the sign says.
    head, feet = np.nonzero(template[12:30])[1].mean(), np.nonzero(template[85:108])[1].mean()
    assert head > feet + 15

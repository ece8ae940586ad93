# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.geometry import Box
from gait_segmentation.starting.hypotheses import VIEWS, Hypothesis, fit_view
from test.walkers import small_bank

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

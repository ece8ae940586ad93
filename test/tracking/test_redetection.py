# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.tracking.redetection import find_silhouette
from test.tracking.figures import Figure

HEIGHT = 100.0


def silhouette() -> np.ndarray:
    mask = Figure(160).mask()
    rows, columns = np.nonzero(mask)
    return mask[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1]


def middle(figure: Figure) -> tuple[float, float]:
    rows, columns = np.nonzero(figure.mask())
    return (columns.min() + columns.max() + 1) / 2, (rows.min() + rows.max() + 1) / 2


@pytest.mark.parametrize('x', [90, 161, 240])
def test_a_silhouette_is_found_where_it_is(x: int) -> None:
    figure = Figure(x)
    found = find_silhouette(figure.mask(), silhouette(), (160, 90), HEIGHT)
    assert found[:2] == pytest.approx(middle(figure), abs=0.01)
    assert found[2] > 0.7


def test_what_is_nearer_is_preferred() -> None:
    both = np.maximum(Figure(80).mask(), Figure(230).mask())
    for x, nearer in ((200, 230), (100, 80)):
        found = find_silhouette(both, silhouette(), (x, 90), HEIGHT)
        assert found[0] == pytest.approx(middle(Figure(nearer))[0], abs=0.01)


def test_a_large_likely_area_is_no_silhouette() -> None:
    area = np.zeros((180, 320), np.uint8)
    area[20:160, 40:280] = 255
    found = find_silhouette(area, silhouette(), (160, 90), HEIGHT)
    assert found[2] < 0.4


def test_without_a_silhouette_nothing_is_found() -> None:
    empty = np.zeros((20, 10), np.uint8)
    assert find_silhouette(Figure(90).mask(), empty, (90, 90), HEIGHT) is None

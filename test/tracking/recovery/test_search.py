# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.tracking.recovery.search import find_silhouette, searched
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
    found = find_silhouette(figure.mask(), silhouette(), (160, 90), (200, 40), HEIGHT)
    assert found is not None
    assert found[:2] == pytest.approx(middle(figure), abs=0.01)
    assert found[2] > 0.7


def test_what_is_nearer_is_preferred_and_what_is_too_far_is_not_looked_at() -> None:
    both = np.maximum(Figure(80).mask(), Figure(230).mask())
    found = find_silhouette(both, silhouette(), (200, 90), (200, 40), HEIGHT)
    assert found is not None
    assert found[0] == pytest.approx(middle(Figure(230))[0], abs=0.01)
    found = find_silhouette(both, silhouette(), (140, 90), (40, 40), HEIGHT)
    assert found is not None
    assert found[2] < 0.4


def test_a_large_likely_area_is_no_silhouette() -> None:
    area = np.zeros((180, 320), np.uint8)
    area[20:160, 40:280] = 255
    found = find_silhouette(area, silhouette(), (160, 90), (100, 20), HEIGHT)
    assert found is not None
    assert found[2] < 0.25


def test_without_a_silhouette_nothing_is_found() -> None:
    empty = np.zeros((20, 10), np.uint8)
    assert find_silhouette(Figure(90).mask(), empty, (90, 90), (50, 50), HEIGHT) is None


@pytest.mark.parametrize('x', [130, 161, 190])
def test_what_is_not_looked_at_changes_nothing(x: int) -> None:
    likelihood, place, reach = Figure(x).mask(), (160.0, 90.0), (50.0, 30.0)
    box = searched(silhouette(), place, reach, HEIGHT)
    rows, columns = box.slices(likelihood.shape[1], likelihood.shape[0])
    assert columns.stop - columns.start < likelihood.shape[1]
    part = np.ascontiguousarray(likelihood[rows, columns])
    inner = (place[0] - columns.start, place[1] - rows.start)
    whole = find_silhouette(likelihood, silhouette(), place, reach, HEIGHT)
    found = find_silhouette(part, silhouette(), inner, reach, HEIGHT)
    assert whole is not None
    assert found is not None
    assert (found[0] + columns.start, found[1] + rows.start) == whole[:2]
    assert found[2] == pytest.approx(whole[2], abs=1e-4)

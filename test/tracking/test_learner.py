# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What masks teach: all of a person, and part of one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from test.tracking.figures import Figure, Told

BOARD = (130, 320)
"""It reaches to the border: who walks behind it comes back."""


def along(places: list[float]) -> list[Figure]:
    return [replace(Figure(60), x=x) for x in places]


@pytest.fixture(scope='module')
def there_and_back() -> tuple[Told, list[Figure], list, list]:
    """Return somebody who goes half behind a board, turns there, and comes back."""
    inward = list(np.arange(60.0, 128.0, 2.0))
    path = along([*inward, *([128.0] * 10), *np.arange(127.0, 70.0, -1.5)])
    told = Told()
    told.start(path[0])
    results, people = [], []
    for figure in path:
        results.append(told.show(figure, boards=[BOARD])[0])
        target = told.tracker._slots[0]
        assert target is not None
        people.append((hash(target.person.person.table.tobytes()), target.body.height))
    return told, path, results, people


def test_somebody_half_hidden_who_turns_is_followed_by_what_is_seen(there_and_back) -> None:
    _, path, results, _ = there_and_back
    for figure, result in zip(path[10:], results[10:], strict=True):
        assert result.state == 'tracked'
        assert result.body.center_x == pytest.approx(figure.x, abs=9)


def test_half_a_body_teaches_neither_colours_nor_size(there_and_back) -> None:
    _, path, _, people = there_and_back
    half = [k for k, figure in enumerate(path) if figure.x >= 126]
    assert len({people[k][0] for k in half}) <= 2
    heights = [people[k][1] for k in half]
    assert max(heights) - min(heights) < 2


def test_afterwards_the_size_is_as_before_and_learning_goes_on(there_and_back) -> None:
    _, path, _, people = there_and_back
    assert people[-1][1] == pytest.approx(path[-1].height, abs=6)
    assert len({colours for colours, _ in people[-10:]}) == 10

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Shifts that are the person's, and such as are not."""

import pytest

from gait_segmentation.tracking.person.pace import is_astray

HEIGHT, USUAL, WAY = 100.0, (6.0, 1.0), 5.0
"""A camera that pans by a pixel, and somebody who goes five pixels a frame."""


def astray(x: float, y: float = 1.0, *, company: bool = False, hidden: bool = False) -> bool:
    return is_astray((x, y), USUAL, WAY, HEIGHT, company=company, hidden=hidden)


@pytest.mark.parametrize('x', [-30.0, 0.0, 6.0, 40.0])
def test_somebody_alone_and_well_seen_may_go_anywhere(x: float) -> None:
    assert not astray(x)


@pytest.mark.parametrize(('x', 'expected'), [(6, False), (8.5, False), (9.5, True), (-4, True)])
def test_beside_somebody_else_people_keep_to_their_pace(x: float, expected: bool) -> None:
    assert astray(x, company=True) is expected


def test_who_goes_fast_may_change_by_more() -> None:
    assert not is_astray((26, 0), (20, 0), 20.0, HEIGHT, company=True, hidden=False)
    assert is_astray((33, 0), (20, 0), 20.0, HEIGHT, company=True, hidden=False)


@pytest.mark.parametrize(('x', 'y', 'expected'), [(-12, 1, False), (6, 24, True), (27, 1, True)])
def test_who_is_half_hidden_does_not_jump(x: float, y: float, expected: bool) -> None:
    assert astray(x, y, hidden=True) is expected

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, strategies as st

from gait_segmentation.errors import InputError
from gait_segmentation.stamps import HeldFrames, Order, Stamps, check_later, check_stamp

MS, S = 1_000_000, 1_000_000_000
FIRST = 1_700_000_000 * S


def orders(*stamps_ms: int) -> str:
    """Return the initials of what is said of stamps, in ms since some day."""
    stamps = Stamps()
    taken = (stamps.take(FIRST + stamp * MS) for stamp in stamps_ms)
    return ' '.join(order.value for order in taken)


@pytest.mark.parametrize(
    ('stamps_ms', 'said'),
    [
        ((0, 33, 67, 100), 'next next next next'),
        # One late, two, the same twice, and as far back as is late.
        ((0, 67, 33, 100), 'next next stale next'),
        ((0, 100, 33, 67, 133), 'next next stale stale next'),
        ((0, 33, 33, 67), 'next next stale next'),
        ((0, 2000, 1000), 'next next stale'),
        # Farther; a bag that loops; an hour ahead, and back.
        ((0, 2001, 1000, 1033), 'next next reset next'),
        ((0, 1500, 3000, 0, 1500), 'next next next reset next'),
        ((0, 33, 3_600_000, 3_600_033, 67), 'next next next next reset'),
    ],
)
def test_what_a_stamp_says(stamps_ms: tuple[int, ...], said: str) -> None:
    assert orders(*stamps_ms) == said


@given(st.lists(st.integers(1, 3 * S), max_size=30))
def test_to_ask_changes_nothing_and_the_newest_is_the_latest_since_a_reset(numbers) -> None:
    stamps, since = Stamps(), [0]
    for each in numbers:
        order = stamps.order(each)
        assert stamps.order(each) is order
        assert stamps.take(each) is order
        since = [0] if order is Order.RESET else since
        since.append(each)
        assert stamps.newest_ns == max(since)


@pytest.mark.parametrize(
    ('stamp', 'said'),
    [
        (0, 'positive nanoseconds, got 0'),
        (-1, 'positive nanoseconds, got -1'),
        (0.033, 'whole nanoseconds, got 0.033'),
        ('7', "whole nanoseconds, got '7'"),
        (None, 'whole nanoseconds, got None'),
    ],
)
def test_stamps_must_be_positive_integers(stamp: object, said: str) -> None:
    check_stamp(np.int64(7))  # type: ignore[arg-type]
    with pytest.raises(InputError, match=said):
        check_stamp(stamp)  # type: ignore[arg-type]
    with pytest.raises(InputError, match='must increase without a reset, got 7 after 7'):
        check_later(7, 7)
    # Microseconds, milliseconds and numbers of frames are none.
    with pytest.raises(InputError, match='nanoseconds, at least 200000 apart, got 200006 after 7'):
        check_later(200_006, 7)
    check_later(200_007, 7)


def test_frames_are_answered_in_order_also_those_passed_over() -> None:
    held: HeldFrames[str] = HeldFrames()
    for stamp_ns, frame in enumerate('abcd'):
        held.hold(stamp_ns, frame)
    second, unasked = SimpleNamespace(stamp_ns=1), SimpleNamespace(stamp_ns=9)
    assert list(held.answered([unasked, second, second])) == [('a', None), ('b', second)]
    assert list(held.answered([])) == []
    assert list(held.answered([], last=True)) == [('c', None), ('d', None)]


def test_frames_that_nothing_comes_for_wait_only_for_those_before() -> None:
    held: HeldFrames[str] = HeldFrames()
    held.hold(None, 'a')
    assert list(held.answered([])) == [('a', None)]
    held.hold(1, 'b')
    held.hold(None, 'c')
    assert list(held.answered([])) == []
    second = SimpleNamespace(stamp_ns=1)
    assert list(held.answered([second])) == [('b', second), ('c', None)]

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from types import SimpleNamespace

import pytest

from gait_segmentation.held_frames import HeldFrames


def test_results_take_their_frames_and_pass_over_those_without() -> None:
    held: HeldFrames[str] = HeldFrames()
    for stamp_ns, frame in enumerate('abcd'):
        held.hold(stamp_ns, frame)
    assert (held.take(0), held.take(2), len(held)) == ('a', 'c', 1)
    with pytest.raises(IndexError):
        held.take(1)
    assert len(held) == 0
    held.hold(5, 'a')
    held.clear()
    held.hold(3, 'b')
    assert held.take(3) == 'b'


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

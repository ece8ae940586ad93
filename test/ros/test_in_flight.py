# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

from gait_segmentation.ros.in_flight import InFlight


def flying(frames: int, answered: int | None = None) -> InFlight:
    made = InFlight(3)
    for stamp in range(1, frames + 1):
        made.add(stamp)
    if answered is not None:
        made.answered(answered)
    return made


def test_nothing_is_held_before_feedback_came() -> None:
    assert not flying(10).full


def test_frames_ahead_of_their_feedback_are_counted() -> None:
    made = flying(4, answered=2)
    assert not made.full
    made.add(5)
    assert made.full
    made.answered(3)
    assert not made.full


def test_feedback_of_frames_that_were_forgotten_says_nothing() -> None:
    made = flying(4, answered=2)
    made.clear()
    made.answered(3)
    for stamp in (1, 2):
        made.add(stamp)
    assert not made.full
    made.add(3)
    assert made.full


def test_late_feedback_holds_nothing() -> None:
    """As with a matcher that lags by more than the limit."""
    made = flying(10, answered=5)
    assert not made.full
    for stamp in range(11, 30):
        made.add(stamp)
        made.answered(stamp - 5)
        assert not made.full


def test_who_gave_up_begins_again_when_feedback_is_in_time() -> None:
    made = flying(6, answered=3)
    assert not made.full
    made.answered(4)
    made.add(7)
    assert made.full
    made.give_up()
    assert not made.full
    made.answered(5)
    made.add(8)
    assert made.full

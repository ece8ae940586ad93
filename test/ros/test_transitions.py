# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import threading

import pytest

from gait_segmentation.ros.transitions import Aside


def test_others_have_their_turn_until_what_is_done_aside_has_ended() -> None:
    go_on = threading.Event()
    turns = Aside(go_on.wait, wake=lambda: None).__await__()
    for _ in range(3):
        next(turns)
    go_on.set()
    assert list(turns) in ([], [None])


def test_what_is_done_already_gives_way_once_and_hands_on_its_error() -> None:
    woken = threading.Event()
    aside = Aside(lambda: [][0], wake=woken.set)
    # Whoever is woken finds that it is done.
    assert woken.wait(60)
    assert aside.done()
    assert list(aside.__await__()) == [None]
    with pytest.raises(IndexError):
        aside.result()

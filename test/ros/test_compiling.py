# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import threading

import pytest

from gait_segmentation.ros.compiling import Aside, compiling


def test_what_takes_long_is_said() -> None:
    said, waited = [], threading.Event()

    def say(text: str) -> None:
        said.append(text)
        waited.set()

    with compiling(say, patience_s=0.0):
        assert waited.wait(60)
    assert len(said) == 1
    assert 'compiling' in said[0]


def test_what_does_not_is_not() -> None:
    said: list[str] = []
    with compiling(said.append, patience_s=3600.0):
        pass
    assert not said


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
    assert aside.done
    assert list(aside.__await__()) == [None]
    with pytest.raises(IndexError):
        aside.check()


def test_a_full_disk_under_the_cache_is_said_to_be_there() -> None:
    with pytest.raises(OSError, match='full') as caught, compiling(print, patience_s=3600.0):
        raise OSError(28, 'full')
    assert caught.value.filename == 'the cache of compiled kernels'

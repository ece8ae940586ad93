# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import threading

import pytest

from gait_segmentation.ros.compiling import compiling


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


def test_a_full_disk_under_the_cache_is_said_to_be_there() -> None:
    with pytest.raises(OSError, match='full') as caught, compiling(print, patience_s=3600.0):
        raise OSError(28, 'full')
    assert caught.value.filename == 'the cache of compiled kernels'

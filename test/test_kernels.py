# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import sys
from types import ModuleType

import pytest
from numba import njit

from gait_segmentation.kernels import Kernels


def test_kernels_of_this_package_are_counted_when_they_are_ready(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def own(number: int) -> int:
        return number + 1

    def other(number: int) -> int:
        return number + 2

    before = Kernels.now()
    module = ModuleType('gait_segmentation.made_up')
    own.__module__ = module.__name__
    module.own, module.other = njit(own), njit(other)
    monkeypatch.setitem(sys.modules, module.__name__, module)
    known = Kernels.now()
    assert (known.known - before.known, known.ready - before.ready) == (1, 0)
    module.own(1)
    module.other(1)
    ready = Kernels.now()
    assert (ready.known - known.known, ready.ready - known.ready) == (0, 1)
    assert ready.compiled - known.compiled == 1

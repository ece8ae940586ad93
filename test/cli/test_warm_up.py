# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import pytest

from gait_segmentation import kernels as module
from gait_segmentation.cli import warm_up as command
from gait_segmentation.kernels import kernel


def test_when_all_is_compiled_there_is_nothing_to_do(capsys) -> None:
    assert command.main([]) == 0
    capsys.readouterr()
    assert command.main([]) == 0
    assert capsys.readouterr().out == "nothing to do: all kernels are in Numba's cache\n"


def test_what_is_compiled_is_counted(monkeypatch: pytest.MonkeyPatch, tmp_path, capsys) -> None:
    for name in ('_declared', '_ready'):
        monkeypatch.setattr(module, name, [])
    monkeypatch.setattr(module, '_PACKAGE', 'test')
    monkeypatch.setattr('numba.core.config.CACHE_DIR', str(tmp_path))

    @kernel('i8', 'f8')
    def made_up(number: int) -> int:
        return number + 1

    assert command.main([]) == 0
    assert capsys.readouterr().out == 'kernels compiled, and kept for the next start: 2\n'

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

from pathlib import Path

import pytest
from numba import njit

from gait_segmentation.cli import warm_up as command
from gait_segmentation.kernels import Kernels
from test.walkers import small_bank


def test_when_all_is_compiled_there_is_nothing_to_do(tmp_path: Path, capsys) -> None:
    small_bank().save(tmp_path / 'bank.npz')
    file = tmp_path / 'mine.yaml'
    file.write_text(f'/**: {{ros__parameters: {{bank: {tmp_path}/bank.npz}}}}')
    assert command.main(['--params', str(file)]) == 0
    capsys.readouterr()
    assert command.main(['--params', str(file)]) == 0
    ready = Kernels.now().ready
    assert capsys.readouterr().out == (
        f"nothing to do: all {ready} kernels are in Numba's cache\n"
    )


def test_what_is_compiled_is_counted(monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    def kernel(number: int) -> int:
        return number + 1

    kernel.__module__ = command.__name__
    made = njit(kernel)
    monkeypatch.setattr(command, '_kernel', made, raising=False)
    before = Kernels.now()
    monkeypatch.setattr(command, 'warm_up', lambda config, bank: made(1))
    monkeypatch.setattr(command, 'open_bank', lambda path: None)
    assert command.main([]) == 0
    assert capsys.readouterr().out == 'kernels compiled, and kept for the next start: 1\n'
    now = Kernels.now()
    assert (now.ready - before.ready, now.known - before.known) == (1, 0)


def test_a_file_of_parameters_that_cannot_be_read_is_an_error(tmp_path: Path, capsys) -> None:
    assert command.main(['--params', str(tmp_path / 'none.yaml')]) == 2
    assert 'none.yaml cannot be read' in capsys.readouterr().err

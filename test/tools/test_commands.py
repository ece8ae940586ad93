# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The commands of the tools, which are started as those of the package are."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

from gait_segmentation import commands as of_package
from gait_tools import commands

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize('name', commands.__all__)
@pytest.mark.usefixtures('signal_handlers')
def test_every_command_runs_its_module(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    found = []

    class Module:
        @staticmethod
        def main() -> int:
            return 3

    monkeypatch.setattr(sys, 'argv', [f'gait_{name}'])
    monkeypatch.setattr(of_package, 'import_module', lambda each: found.append(each) or Module)
    assert getattr(commands, name)() == 3
    assert found == [f'gait_tools.cli.{name}']
    assert (ROOT / f'tools/gait_tools/cli/{name}.py').is_file()


def test_all_commands_are_installed() -> None:
    text = (ROOT / 'tools/setup.py').read_text(encoding='utf-8')
    points = re.findall(r"'gait_(\w+) = ([\w.]+):(\w+)'", text)
    assert sorted(points) == [(name, commands.__name__, name) for name in commands.__all__]

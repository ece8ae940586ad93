# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The commands of the nodes, interrupted while they import."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from gait_segmentation.nodes import start

ROOT = Path(__file__).resolve().parents[2]

SCRIPT = """
import sys, time
class Slow:
    def find_spec(self, name, path=None, target=None):
        if name == 'cv2':
            print('importing', flush=True)
            time.sleep(100)
sys.meta_path.insert(0, Slow())
from gait_segmentation.nodes.start import tracker
sys.exit(tracker())
"""


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_during_the_imports_ends_a_node_quietly(number: signal.Signals) -> None:
    with subprocess.Popen(
        [sys.executable, '-c', SCRIPT],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == 'importing\n'
        process.send_signal(number)
        _, said = process.communicate(timeout=60)
    assert process.returncode == 0
    assert said == ''


@pytest.mark.parametrize('name', start.__all__)
def test_every_command_runs_its_node(name: str, monkeypatch) -> None:
    found = []
    handlers = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]

    class Module:
        @staticmethod
        def main() -> int:
            assert handlers == [signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM)]
            return 3

    monkeypatch.setattr(start, 'import_module', lambda each: found.append(each) or Module)
    assert getattr(start, name)() == 3
    assert found == [f'gait_segmentation.nodes.{name}_node']
    assert Path(ROOT / f'{found[0].replace(".", "/")}.py').is_file()


def test_all_nodes_are_installed_as_commands() -> None:
    points = re.findall(r"'gait_(\w+) = ([\w.]+):(\w+)'", (ROOT / 'setup.py').read_text())
    nodes = {name: function for name, module, function in points if module == start.__name__}
    assert nodes == {name: name for name in start.__all__}

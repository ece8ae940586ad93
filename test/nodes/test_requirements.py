# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes run without what only the command line tools need."""

from __future__ import annotations

import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

from gait_segmentation.errors import EXTRAS

ROOT = Path(__file__).parents[2]
TIMEOUT_S = 300

WITHOUT = f"""
import sys
from importlib import import_module
TOOLS = {[*EXTRAS, 'matplotlib', 'motmetrics', 'sklearn']}
for name in TOOLS:
    sys.modules[name] = None
"""


def run(program: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, '-c', WITHOUT + program, *arguments],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=TIMEOUT_S,
        check=False,
    )


def test_nodes_and_their_warm_up_import_nothing_that_only_tools_need() -> None:
    names = [f'nodes.{path.stem}' for path in (ROOT / 'gait_segmentation/nodes').glob('*_node.py')]
    assert 'nodes.pipeline_node' in names
    program = (
        f'for name in {[*names, "cli.warm_up"]}:\n'
        "    import_module(f'gait_segmentation.{name}')\n"
        'from gait_segmentation import pipeline, tracking, matching, segmentation, starting\n'
        "print('imported')"
    )
    done = run(program)
    assert done.stdout.strip() == 'imported', done.stderr


def test_rosdep_installs_nothing_that_only_tools_need() -> None:
    package = ElementTree.parse(ROOT / 'package.xml').getroot()
    needed = {each.text for each in package.iter('exec_depend')}
    assert 'python3-numpy' in needed
    assert not needed & {f'python3-{name}' for name in EXTRAS}


@pytest.mark.parametrize('name', ['walk.mcap', 'walk.db3', 'walk.bag'])
def test_a_bag_says_what_to_install(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(b'')
    program = (
        'from pathlib import Path\n'
        'from gait_segmentation.errors import SequenceError\n'
        'from gait_segmentation.inputs import open_input\n'
        'try:\n'
        '    open_input(Path(sys.argv[1]))\n'
        'except SequenceError as error:\n'
        '    print(error)'
    )
    done = run(program, str(tmp_path / name))
    expected = f'{tmp_path / name} is a bag: the Python package mcap is not installed: pip install'
    assert done.stdout.startswith(expected), done.stderr

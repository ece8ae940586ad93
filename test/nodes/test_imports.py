# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a node imports, each in a process of its own, and what it needs installed."""

from __future__ import annotations

import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

from gait_segmentation.errors import EXTRAS

ROOT = Path(__file__).parents[2]
NEVER = (*EXTRAS, 'sklearn', 'matplotlib', 'motmetrics', 'gait_tools')
OTHERS = {
    'cli.warm_up': (),
    'nodes.detector_node': (
        'mediapipe',
        'gait_segmentation.matching',
        'gait_segmentation.segmentation',
        'gait_segmentation.tracking',
    ),
    'nodes.tracker_node': ('gait_segmentation.pipeline',),
    'nodes.matcher_node': ('gait_segmentation.segmentation', 'gait_segmentation.tracking'),
    'nodes.localizer_node': (
        'gait_segmentation.matching',
        'gait_segmentation.segmentation',
        'gait_segmentation.tracking',
    ),
    'nodes.segmenter_node': ('gait_segmentation.matching', 'gait_segmentation.tracking'),
    'nodes.pipeline_node': (),
}


@pytest.mark.parametrize('name', OTHERS)
def test_a_node_imports_its_own_stage_alone(name: str) -> None:
    script = f'import sys, gait_segmentation.{name}; print(*sys.modules, sep="\\n")'
    done = subprocess.run(
        [sys.executable, '-c', script], cwd=ROOT, capture_output=True, text=True, check=True
    )
    imported = set(done.stdout.split())
    assert f'gait_segmentation.{name}' in imported
    assert imported.isdisjoint((*NEVER, *OTHERS[name]))


def test_rosdep_installs_nothing_that_only_tools_need() -> None:
    package = ElementTree.parse(ROOT / 'package.xml').getroot()
    needed = {each.text for each in package.iter('exec_depend')}
    assert 'python3-numpy' in needed
    assert not needed & {f'python3-{name}' for name in EXTRAS}


@pytest.mark.parametrize('name', ['walk.mcap', 'walk.db3', 'walk.bag'])
def test_a_bag_says_what_to_install(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(b'')
    program = f"""
import sys
sys.modules.update(dict.fromkeys({[*EXTRAS]}))
from pathlib import Path
from gait_segmentation.errors import SequenceError
from gait_segmentation.inputs import open_input
try:
    open_input(Path(sys.argv[1]))
except SequenceError as error:
    print(error)
"""
    command = [sys.executable, '-c', program, str(tmp_path / name)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    expected = (
        f'{tmp_path / name} is a bag: the Python package rosbags is not installed: pip install'
    )
    assert done.stdout.startswith(expected), done.stderr

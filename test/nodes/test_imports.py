# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a node imports, each in a process of its own: all of it delays the start."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

NEVER = ('sklearn', 'matplotlib', 'rosbags', 'motmetrics', 'gait_tools')
OTHERS = {
    'tracker_node': ('gait_segmentation.pipeline',),
    'matcher_node': ('gait_segmentation.segmentation', 'gait_segmentation.tracking'),
    'localizer_node': (
        'gait_segmentation.matching',
        'gait_segmentation.segmentation',
        'gait_segmentation.tracking',
    ),
    'segmenter_node': ('gait_segmentation.matching', 'gait_segmentation.tracking'),
    'pipeline_node': (),
    'source_node': ('numba', 'gait_segmentation.gait_model', 'gait_segmentation.tracking'),
}


@pytest.mark.parametrize('name', OTHERS)
def test_a_node_imports_its_own_stage_alone(name: str) -> None:
    script = f'import sys, gait_segmentation.nodes.{name}; print(*sys.modules, sep="\\n")'
    root = Path(__file__).resolve().parents[2]
    done = subprocess.run(
        [sys.executable, '-c', script], cwd=root, capture_output=True, text=True, check=True
    )
    imported = set(done.stdout.split())
    assert f'gait_segmentation.nodes.{name}' in imported
    assert imported.isdisjoint((*NEVER, *OTHERS[name]))

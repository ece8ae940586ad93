# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a node imports, and what it needs installed."""

from __future__ import annotations

import ast
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


def at_import(path: Path) -> set[str]:
    """Return the names of the modules that a file imports when it is imported itself."""
    names: set[str] = set()
    waiting: list[ast.AST] = [ast.parse(path.read_text())]
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.Import):
            names |= {each.name for each in node.names}
        elif isinstance(node, ast.ImportFrom):
            names |= {f'{node.module}.{each.name}' for each in node.names} | {str(node.module)}
        lazy = isinstance(node, ast.FunctionDef) or (
            isinstance(node, ast.If) and 'TYPE_CHECKING' in ast.unparse(node.test)
        )
        waiting += [] if lazy else ast.iter_child_nodes(node)
    return names


def imported(name: str) -> set[str]:
    """Return all that comes with a module of this package, and the packages it is in."""
    found: set[str] = set()
    waiting = {name}
    while waiting:
        each = waiting.pop()
        found.add(each)
        path = ROOT / each.replace('.', '/')
        for file in (path.with_suffix('.py'), path / '__init__.py'):
            if each.startswith('gait_segmentation') and file.is_file():
                waiting |= at_import(file) - found
        waiting |= {each.rpartition('.')[0]} - {'', *found}
    return found


@pytest.mark.parametrize('name', OTHERS)
def test_a_node_imports_its_own_stage_alone(name: str) -> None:
    found = imported(f'gait_segmentation.{name}')
    assert found >= {'gait_segmentation.kernels', 'numpy'}
    assert found.isdisjoint((*NEVER, *OTHERS[name]))


def test_rosdep_installs_nothing_that_only_tools_need() -> None:
    package = ElementTree.parse(ROOT / 'package.xml').getroot()
    needed = {each.text for each in package.iter('exec_depend')}
    assert 'python3-numpy' in needed
    assert not needed & {f'python3-{name}' for name in EXTRAS}

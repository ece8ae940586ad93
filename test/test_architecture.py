# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the layout promises: algorithms know nothing of ROS, of clocks and of files."""

from __future__ import annotations

import ast
import xml.etree.ElementTree as ElementTree
from functools import cache
from pathlib import Path

import pytest

from gait_segmentation.errors import EXTRAS

PACKAGE = Path(__file__).parent.parent / 'gait_segmentation'
TOOLS = Path(__file__).parent.parent / 'tools/gait_tools'
ADAPTERS = {'ros', 'nodes', 'cli', 'demo'}
MESSAGES = {'rclpy', 'builtin_interfaces', 'rcl_interfaces', 'launch', 'launch_ros'}
CLOCKS = {'time', 'datetime'}
ALGORITHMS = ('tracking', 'matching', 'segmentation', 'starting', 'scene', 'paper')


def modules(*parts: str) -> list[Path]:
    roots = [PACKAGE / part for part in parts] if parts else [PACKAGE, TOOLS]
    return sorted(
        path
        for root in roots
        for path in root.rglob('*.py')
        if not ADAPTERS & set(path.relative_to(PACKAGE.parent).parts)
    )


@cache
def parsed(path: Path) -> list[ast.AST]:
    return list(ast.walk(ast.parse(path.read_text())))


def imported(path: Path) -> set[str]:
    names = set()
    for node in parsed(path):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names.add(node.module)
    return names


def module_name(path: Path) -> str:
    return '.'.join(path.relative_to(PACKAGE.parent).with_suffix('').parts)


def in_circles(needs: dict[str, set[str]]) -> list[str]:
    """Return what is left when all is taken away that needs nothing that is left."""
    while free := {name for name, others in needs.items() if not others & needs.keys()}:
        needs = {name: others for name, others in needs.items() if name not in free}
    return sorted(needs)


def test_there_is_something_to_look_at() -> None:
    assert len(modules()) > 100
    assert 'numpy' in imported(PACKAGE / 'pipeline.py')
    assert all(modules(stage) for stage in ALGORITHMS)


def test_what_robots_run_knows_nothing_of_the_tools() -> None:
    assert any('gait_segmentation.pipeline' in imported(path) for path in TOOLS.rglob('*.py'))
    for path in PACKAGE.rglob('*.py'):
        assert 'gait_tools' not in {name.split('.')[0] for name in imported(path)}, path


def test_nodes_load_nothing_that_reads_files() -> None:
    loaded, waiting = set(), {module_name(path) for path in (PACKAGE / 'nodes').glob('*.py')}
    while waiting:
        loaded.add(name := waiting.pop())
        place = PACKAGE.parent / name.replace('.', '/')
        file = place / '__init__.py' if place.is_dir() else place.with_suffix('.py')
        if file.exists():
            # With a module come the packages that it is in.
            parents = {each.rpartition('.')[0] for each in imported(file)}
            waiting |= (imported(file) | parents) - loaded - {''}
    assert {'gait_segmentation.encodings', 'gait_segmentation.detector.engine'} <= loaded
    assert not {name for name in loaded if name.startswith('gait_segmentation.inputs')}


def test_only_adapters_import_ros() -> None:
    adapters = tuple(f'gait_segmentation.{name}' for name in ADAPTERS)
    for path in modules():
        roots = {name.split('.')[0] for name in imported(path)}
        assert not roots & MESSAGES, path
        assert not {root for root in roots if root.endswith(('_msgs', '_srvs'))}, path
        assert not {name for name in imported(path) if name.startswith(adapters)}, path


def test_only_adapters_read_clocks() -> None:
    for path in modules():
        assert not {name.split('.')[0] for name in imported(path)} & CLOCKS, path


def test_the_stages_open_no_files() -> None:
    for path in modules(*ALGORITHMS):
        calls = {
            node.func.id
            for node in parsed(path)
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
        }
        assert not calls & {'open', 'print', 'input'}, path


def test_every_module_has_its_licence() -> None:
    roots = PACKAGE, TOOLS.parent, Path(__file__).parent
    for path in (path for root in roots for path in root.rglob('*.py')):
        text = path.read_text()
        if text:
            assert 'SPDX-License-Identifier: GPL-3.0-or-later' in text.split('\n\n')[0], path


def test_no_folders_need_each_other() -> None:
    folders = {path.name for path in PACKAGE.iterdir() if (path / '__init__.py').exists()}
    needs = {
        folder: {
            name.split('.')[1]
            for path in (PACKAGE / folder).rglob('*.py')
            for name in imported(path)
            if name.startswith('gait_segmentation.')
        }
        & folders - {folder}
        for folder in folders
    }
    assert needs['tracking'] >= {'scene', 'starting'}
    assert not in_circles(needs)


def test_no_files_need_each_other() -> None:
    files = {module_name(path): path for path in PACKAGE.rglob('*.py') if path.name[0] != '_'}
    needs = {name: (imported(path) & files.keys()) - {name} for name, path in files.items()}
    assert needs['gait_segmentation.pipeline']
    assert not in_circles(needs)


def test_stages_do_not_know_each_other_but_for_the_start() -> None:
    """The open door: each stage works on what anybody may publish."""
    allowed = {
        'tracking': {'scene', 'starting', 'paper'},
        'segmentation': {'paper'},
        'starting': {'scene', 'segmentation', 'matching'},
    }
    for stage in ALGORITHMS:
        others = set(ALGORITHMS) - {stage} - allowed.get(stage, set())
        for path in modules(stage):
            used = {name.split('.')[1] for name in imported(path) if name.count('.') >= 1}
            assert not used & others, path


ROOT = Path(__file__).parents[1]
NEVER = (*EXTRAS, 'sklearn', 'matplotlib', 'motmetrics', 'gait_tools')
OTHERS = {
    'cli.warm_up': (),
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


def all_imported(name: str) -> set[str]:
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
    found = all_imported(f'gait_segmentation.{name}')
    assert found >= {'gait_segmentation.kernels', 'numpy'}
    assert found.isdisjoint((*NEVER, *OTHERS[name]))


def test_rosdep_installs_nothing_that_only_tools_need() -> None:
    package = ElementTree.parse(ROOT / 'package.xml').getroot()
    needed = {each.text for each in package.iter('exec_depend')}
    assert 'python3-numpy' in needed
    assert not needed & {f'python3-{name}' for name in EXTRAS}

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The parameter file and the page of the docs, made from the configuration dataclasses.

``python -m gait_segmentation.nodes.parameter_table`` prints the file; with ``--update .`` it
writes ``config/gait_segmentation.yaml`` and the tables in ``docs/parameters.md`` of a source tree.
"""

from __future__ import annotations

import argparse
import textwrap
from pathlib import Path
from typing import Any

import numpy as np

from gait_segmentation.config import Parameter, StageConfig, parameters_of
from gait_segmentation.nodes.matcher_node import MatcherNode
from gait_segmentation.nodes.pipeline_node import PipelineNode
from gait_segmentation.nodes.segmenter_node import SegmenterNode
from gait_segmentation.nodes.tracker_node import TrackerNode
from gait_segmentation.ros.config import NodeConfig, StartConfig
from gait_segmentation.ros.lifecycle import GaitNode
from gait_segmentation.ros.names import qualified
from gait_segmentation.ros.parameters import INITIAL_BOX

__all__ = ['markdown', 'parameter_file', 'with_tables']

NODES: dict[str, type[GaitNode]] = {
    'gait_tracker': TrackerNode,
    'gait_matcher': MatcherNode,
    'gait_segmenter': SegmenterNode,
    'gait_pipeline': PipelineNode,
}

_WIDTH = 99
_BEGIN, _END = '<!-- parameters -->\n', '<!-- end -->'

_HEAD = """\
# Parameters of all nodes of gait_segmentation, with their defaults.
#
# A node takes what it knows and ignores the rest, so one file serves all of them:
#   gait_tracker --ros-args --params-file gait_segmentation.yaml
# [fixed] parameters cannot be changed while a node runs.
#
# Made by python -m gait_segmentation.nodes.parameter_table; defaults are changed in the code.

/**:
  ros__parameters:
"""

Group = tuple[str, type[StageConfig]]


def parameter_file() -> str:
    """Return the text of ``config/gait_segmentation.yaml``."""
    text = _HEAD
    for (group, kind), nodes in _groups().items():
        words = ', '.join(nodes) if len(nodes) < len(NODES) else 'all nodes'
        text += ('' if text is _HEAD else '\n') + f'    # ---- {words}\n'
        indent = '    '
        if group:
            text += f'    {group}:\n'
            indent = '      '
        for about in _parameters(kind):
            for line in textwrap.wrap(_comment(about), _WIDTH - len(indent) - 2):
                text += f'{indent}# {line}\n'
            text += f'{indent}{about.name}: {_value(about.default)}\n'
    return text


def markdown() -> str:
    """Return the tables of all parameters, one of the nodes' own and one a stage."""
    text, section = '', None
    for (group, kind), nodes in _groups().items():
        of = 'all' if len(nodes) == len(NODES) else ', '.join(nodes)
        if group != section:
            section = group
            title = f'{group} ({of})' if group else 'The nodes themselves'
            columns = [
                'parameter',
                'default',
                'allowed',
                *([] if group else ['of']),
                'description',
            ]
            text += '\n' if text else ''
            text += f'## {title}\n\n{_row(columns)}|{"---|" * len(columns)}\n'
        for about in _parameters(kind):
            allowed = '4 numbers' if about.type is list else about.allowed()
            unit = f' [{about.unit}]' if about.unit else ''
            fixed = ' *(fixed)*' if about.read_only else ''
            text += _row(
                [
                    f'`{qualified(group, about.name)}`',
                    f'`{_value(about.default)}`{unit}',
                    allowed,
                    *([] if group else [of.replace('gait_', '')]),
                    f'{about.description}{fixed}',
                ]
            )
    return text


def _row(cells: list[str]) -> str:
    return f'| {" | ".join(cells)} |\n'


def _groups() -> dict[Group, list[str]]:
    """Return the nodes that have each group of parameters, in the order of first use."""
    found: dict[Group, list[str]] = {}
    for name, node in NODES.items():
        for group in (('', NodeConfig), *node.groups):
            found.setdefault(group, []).append(name)
    return dict(sorted(found.items(), key=lambda item: item[0][0] != ''))


def _parameters(kind: type[StageConfig]) -> tuple[Parameter, ...]:
    own = parameters_of(kind)
    return (INITIAL_BOX, *own) if kind is StartConfig else own


def _comment(about: Parameter) -> str:
    allowed = '4 numbers' if about.type is list else about.allowed()
    unit = f', in {about.unit}' if about.unit else ''
    fixed = ' [fixed]' if about.read_only else ''
    return f'{about.description} ({allowed}{unit}){fixed}'


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return str(np.format_float_positional(value, trim='0'))
    if isinstance(value, list):
        return '[' + ', '.join(_value(each) for each in value) + ']'
    return f"'{value}'" if isinstance(value, str) else str(value)


def with_tables(docs: str) -> str:
    """Return a page with its tables, between its marks, made anew."""
    head, _, rest = docs.partition(_BEGIN)
    return f'{head}{_BEGIN}{markdown()}{_END}{rest.partition(_END)[2]}'


def main() -> None:
    """Print or update."""
    parser = argparse.ArgumentParser(description='Print the parameter file.')
    parser.add_argument('--update', type=Path, metavar='ROOT', help='write file and docs instead')
    root = parser.parse_args().update
    if root is None:
        print(parameter_file(), end='')
        return
    docs = root / 'docs/parameters.md'
    (root / 'config/gait_segmentation.yaml').write_text(parameter_file(), encoding='utf-8')
    docs.write_text(with_tables(docs.read_text(encoding='utf-8')), encoding='utf-8')


if __name__ == '__main__':
    main()

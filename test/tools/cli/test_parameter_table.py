# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from itertools import chain
from pathlib import Path

import pytest
import yaml

from gait_segmentation.config import parameters_of
from gait_segmentation.streams.config import NodeConfig, misnamed, qualified

pytest.importorskip('rclpy', reason='needs ROS 2: rclpy cannot be imported')

from gait_tools.cli.parameter_table import NODES, listed, markdown, parameter_file

ROOT = Path(__file__).parents[3]
COMMAND = 'python -m gait_tools.cli.parameter_table --update .'


def test_the_file_is_up_to_date() -> None:
    written = (ROOT / 'config/gait_segmentation.yaml').read_text(encoding='utf-8')
    assert written == parameter_file(), f'run {COMMAND}'


def test_the_file_holds_every_parameter_at_its_default() -> None:
    values = yaml.safe_load(parameter_file())['/**']['ros__parameters']
    for node in NODES.values():
        for group, kind in (('', NodeConfig), *node.groups):
            for about in listed(kind):
                place = values[group] if group else values
                assert about.meant(place[about.name]) == about.default
                assert type(about.meant(place[about.name])) is about.type


def test_the_docs_hold_every_parameter_once() -> None:
    tables = markdown()
    for node in NODES.values():
        for group, kind in (('', NodeConfig), *node.groups):
            for about in listed(kind):
                assert tables.count(f'| `{qualified(group, about.name)}` |') == 1
    docs = (ROOT / 'docs/parameters.md').read_text(encoding='utf-8')
    assert tables in docs, f'run {COMMAND}'


def test_what_is_of_another_node_is_not_taken_for_a_mistake() -> None:
    names = {
        node: [
            qualified(group, about.name)
            for group, kind in (('', NodeConfig), *node.groups)
            for about in parameters_of(kind)
        ]
        for node in NODES.values()
    }
    for known in names.values():
        assert misnamed(chain(*names.values()), known) == {}

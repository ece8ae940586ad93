# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The views of rviz and Foxglove against what the nodes really publish."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml
from geometry_msgs.msg import PoseWithCovarianceStamped
from sensor_msgs.msg import Image
from visualization_msgs.msg import MarkerArray

from gait_segmentation.nodes.localizer_node import LocalizerNode
from gait_segmentation.nodes.pipeline_node import PipelineNode
from test.nodes.bench import Bench

ROOT = Path(__file__).parents[2]
CONFIG = ROOT / 'config'
HOW_TO = (ROOT / 'docs/ros_howto.md').read_text(encoding='utf-8')
SHOWN_KINDS = {
    'Image': Image,
    'MarkerArray': MarkerArray,
    'PoseWithCovariance': PoseWithCovarianceStamped,
}


def strings(values: Any) -> Iterator[str]:
    """Yield the texts in nested lists and dictionaries, keys as well."""
    if isinstance(values, dict):
        for name, value in values.items():
            yield from (name, *strings(value))
    elif isinstance(values, list):
        for value in values:
            yield from strings(value)
    elif isinstance(values, str):
        yield values


def test_all_that_rviz_and_foxglove_show_is_published(bench: Bench) -> None:
    nodes = [bench.add(kind) for kind in (PipelineNode, LocalizerNode)]
    made = {each.topic_name: each.msg_type for node in nodes for each in node.publishers}
    view = yaml.safe_load((CONFIG / 'gait_segmentation.rviz').read_text(encoding='utf-8'))
    shown = [each for each in view['Visualization Manager']['Displays'] if 'Topic' in each]
    assert len(shown) == 3
    for each in shown:
        kind = SHOWN_KINDS[each['Class'].removeprefix('rviz_default_plugins/')]
        assert made[each['Topic']['Value']] is kind
        assert f'*{each["Name"]}*: `{each["Topic"]["Value"]}`' in HOW_TO
    layout = json.loads((CONFIG / 'foxglove_layout.json').read_text(encoding='utf-8'))
    named = {text.partition('.')[0] for text in strings(layout) if text.startswith('/')}
    assert len(named) >= 7
    assert named <= set(made)
    panels = {text for text in strings(layout['layout']) if '!' in text}
    assert panels == set(layout['configById'])

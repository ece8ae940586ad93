# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The policy for SROS2 against what the nodes really publish, subscribe to and serve."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
import yaml
from geometry_msgs.msg import PoseWithCovarianceStamped
from sensor_msgs.msg import Image
from visualization_msgs.msg import MarkerArray

from gait_segmentation.nodes.localizer_node import LocalizerNode
from gait_segmentation.nodes.matcher_node import MatcherNode
from gait_segmentation.nodes.pipeline_node import PipelineNode
from gait_segmentation.nodes.segmenter_node import SegmenterNode
from gait_segmentation.nodes.tracker_node import TrackerNode
from test.nodes.bench import Bench

POLICY = Path(__file__).parents[2] / 'config/sros2_policy.xml'
KINDS = {
    'gait_tracker': TrackerNode,
    'gait_matcher': MatcherNode,
    'gait_segmenter': SegmenterNode,
    'gait_localizer': LocalizerNode,
    'gait_pipeline': PipelineNode,
}
SOMETIMES = {
    '/image/compressed',  # image_transport: compressed
    '/detections',  # with vision_msgs
    '/tracks',
    '/people',
    '/tf',  # with ground_frame
    '/tf_static',
    '/clock',  # use_sim_time: true
    '/rosout',  # not where logging to it is switched off
}
"""What only some configurations have."""

Rules = Mapping[tuple[str, str], set[str]]


@pytest.fixture(autouse=True)
def alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let nobody else be in the graph: one asks it by name, and nodes that are gone linger."""
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'OFF')


def rules(name: str) -> Rules:
    """Return the names that a node's rules allow, by what and how."""
    (enclave,) = ElementTree.parse(POLICY).iterfind(f".//enclave[@path='/gait/{name}']")
    (profile,) = enclave.iterfind('profiles/profile')
    assert (profile.get('ns'), profile.get('node')) == ('/', name)
    found: dict[tuple[str, str], set[str]] = {}
    for block in profile:
        ((how, ruling),) = block.attrib.items()
        assert ruling == 'ALLOW'
        names = {_full(str(each.text), name) for each in block}
        assert len(names) == len(block)
        found[block.tag, how] = names
    return found


def _full(name: str, node: str) -> str:
    return re.sub(r'^~', f'/{node}', name) if name[0] in '/~' else f'/{name}'


def real(node: Any) -> Rules:
    """Return the names that a node really has."""

    def names(pairs: Iterable[tuple[str, Any]]) -> set[str]:
        return {name for name, _ in pairs}

    about = (node.get_name(), node.get_namespace())
    return {
        ('topics', 'publish'): names(node.get_publisher_names_and_types_by_node(*about)),
        ('topics', 'subscribe'): names(node.get_subscriber_names_and_types_by_node(*about)),
        ('services', 'reply'): names(node.get_service_names_and_types_by_node(*about)),
    }


def is_known(node: Any) -> bool:
    """Return whether the graph has heard of all that a node has made, which takes a moment."""
    does = real(node)
    return {each.topic_name for each in node.publishers} <= does['topics', 'publish'] and {
        each.topic_name for each in node.subscriptions
    } <= does['topics', 'subscribe']


@pytest.mark.parametrize('name', KINDS)
def test_each_node_may_do_what_it_does_and_nothing_else(bench: Bench, name: str) -> None:
    node = bench.add(KINDS[name], max_people=2)
    bench.until(lambda: is_known(node), 'the graph to know the node')
    allowed, does = rules(name), real(node)
    assert set(allowed) == set(does)
    for key, patterns in allowed.items():
        refused = [x for x in does[key] if not any(fnmatchcase(x, each) for each in patterns)]
        assert not refused, f'{key} needs rules for {refused}'
        idle = [x for x in patterns - SOMETIMES if not any(fnmatchcase(y, x) for y in does[key])]
        assert not idle, f'{key} has rules that nothing needs: {idle}'


def test_there_is_an_enclave_for_every_node() -> None:
    paths = [each.get('path') for each in ElementTree.parse(POLICY).iterfind('.//enclave')]
    assert paths == [f'/gait/{name}' for name in KINDS]


CONFIG = Path(__file__).parents[2] / 'config'
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
    layout = json.loads((CONFIG / 'foxglove_layout.json').read_text(encoding='utf-8'))
    named = {text.partition('.')[0] for text in strings(layout) if text.startswith('/')}
    assert len(named) >= 7
    assert named <= set(made)
    panels = {text for text in strings(layout['layout']) if '!' in text}
    assert panels == set(layout['configById'])

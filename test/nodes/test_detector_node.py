# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""gait_detector over real DDS, with a mediapipe that is none."""

from __future__ import annotations

import os
import subprocess
import threading
from pathlib import Path

import cv2
import numpy as np
import pytest
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import CompressedImage, Image

from gait_segmentation.detector.client import PYTHON
from gait_segmentation.inputs.encodings import read_heat_map
from gait_segmentation.nodes.detector_node import DetectorNode
from gait_segmentation.ros.messages import image_message
from test.detectors import FATAL, fake_python, image
from test.nodes.bench import Bench, header


@pytest.fixture(autouse=True)
def python(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setenv(PYTHON, fake_python(tmp_path))


@pytest.mark.parametrize('transport', ['raw', 'compressed'])
def test_every_image_gives_a_map_with_its_header(bench: Bench, transport: str) -> None:
    node = bench.add(DetectorNode, image_transport=transport)
    maps = bench.record(Image, 'heat_map', qos_profile_sensor_data)
    kind = Image if transport == 'raw' else CompressedImage
    camera = bench.publisher(kind, node.camera_topic, 1)
    png = cv2.imencode('.png', image())[1].tobytes()
    for index in range(2):
        if transport == 'raw':
            camera.publish(image_message(image(), header(index)))
        else:
            camera.publish(CompressedImage(header=header(index), format='png', data=png))
        bench.until(lambda number=index: len(maps) > number, 'a map')
        assert maps[index].header == header(index)
        np.testing.assert_array_equal(read_heat_map(maps[index]), image()[..., 2])


def test_a_network_that_has_ended_is_started_again(bench: Bench) -> None:
    node = bench.add(DetectorNode)
    maps = bench.record(Image, 'heat_map')
    camera = bench.publisher(Image, 'image', 1)
    camera.publish(image_message(image(), header(0)))
    bench.until(lambda: len(maps) == 1, 'a map')
    camera.publish(image_message(image(FATAL), header(1)))
    bench.until(lambda: node.statistics.failed == 1, 'the end of the network')
    assert 'frame DetectorError' in node.warnings.keys
    camera.publish(image_message(image(), header(2)))
    bench.until(lambda: len(maps) == 2, 'another map')
    assert [each.header for each in maps] == [header(0), header(2)]


def test_of_images_that_wait_only_the_newest_is_taken(bench: Bench, monkeypatch) -> None:
    node = bench.add(DetectorNode)
    begun, go_on = threading.Event(), threading.Event()
    map_of = node.stage.map_of

    def slowly(frame: np.ndarray) -> np.ndarray:
        begun.set()
        go_on.wait()
        return map_of(frame)

    monkeypatch.setattr(node.stage, 'map_of', slowly)
    for index in range(4):
        message = image_message(image(), header(index))
        node.hand_over(index + 1, {'image': message})
        assert begun.wait(60)
    go_on.set()
    bench.settle()
    assert (node.statistics.received, node.statistics.processed) == (4, 2)
    assert node.statistics.skipped == 0


def children() -> set[str]:
    found = subprocess.run(['pgrep', '-P', str(os.getpid())], capture_output=True, text=True)
    return set(found.stdout.split())


def test_the_process_ends_when_the_node_is_inactive(bench: Bench) -> None:
    before = children()
    node = bench.add(DetectorNode)
    (first,) = {each for each in children() - before if Path(f'/proc/{each}').exists()}
    node.trigger_deactivate()
    assert first not in children()
    node.trigger_activate()
    camera = bench.publisher(Image, 'image', 1)
    maps = bench.record(Image, 'heat_map')
    camera.publish(image_message(image(), header(0)))
    bench.until(lambda: bool(maps), 'a map')
    assert {each for each in children() - before if Path(f'/proc/{each}').exists()}
    node.trigger_shutdown()
    assert not {each for each in children() - before if Path(f'/proc/{each}').exists()}


def test_a_node_without_a_network_does_not_start(
    bench: Bench, monkeypatch, tmp_path: Path
) -> None:
    monkeypatch.setenv(PYTHON, str(tmp_path / 'nowhere'))
    assert not bench.add(DetectorNode, start=False).start()

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from pathlib import Path
from types import SimpleNamespace

import pytest

pytest.importorskip('rclpy', reason='needs ROS 2: rclpy cannot be imported')

import rclpy

from gait_tools.demo import camera
from test.inputs.bags import STEP_NS, greys, write_bag2

# rclpy loads deprecated modules of Python with its first publisher.
pytestmark = pytest.mark.filterwarnings('ignore::DeprecationWarning')


@pytest.mark.parametrize(('rate', 'steps'), [(0.0, 3 * [STEP_NS / 1e9]), (50.0, 3 * [0.02])])
def test_a_bag_is_shown_at_its_own_rate_or_another(
    rate: float, steps: list[float], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'OFF')
    slept: list[float] = []
    clock = SimpleNamespace(sleep=slept.append, monotonic=lambda: 7.0 + sum(slept))
    monkeypatch.setattr(camera, 'time', clock)
    bag = write_bag2(tmp_path / 'walk', {'/image': greys(5)})
    rclpy.init(args=[])
    try:
        camera.publish(str(bag), str(tmp_path / 'stamps.txt'), 0, rate=rate, start=1)
    finally:
        rclpy.try_shutdown()
    # Before the first image, the nodes find the camera.
    assert slept == pytest.approx([camera._DISCOVERY_S, 0.0, *steps])
    lines = (tmp_path / 'stamps.txt').read_text().splitlines()
    numbers, stamps = zip(*(map(int, line.split()) for line in lines), strict=True)
    assert numbers == (1, 2, 3, 4)
    assert sorted(set(stamps)) == list(stamps)

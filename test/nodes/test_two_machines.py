# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The graph spread over two machines: two network namespaces joined by a cable."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import pytest

from test.nodes.bench import TIMEOUT_S
from test.walkers import box_of, clip

ROOT = Path(__file__).parents[2]
MASKS = 12

# Machines do not share memory: each has a folder of its own for it.
ALONE = 'mount --bind "$1" /dev/shm && shift && exec "$@"'

PROBE = f"""
import json, sys, time
import rclpy
from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import Image
rclpy.init()
node = Node('probe')
seen = []
node.create_subscription(
    Image, 'mask', lambda m: seen.append([m.header.frame_id, m.width, max(m.data)]),
    QoSProfile(depth=100))
end = time.monotonic() + {TIMEOUT_S}
while time.monotonic() < end and sum(mask[2] > 0 for mask in seen) < {MASKS}:
    rclpy.spin_once(node, timeout_sec=0.1)
print(json.dumps(seen))
"""


def run(*command: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command, capture_output=True, text=True, check=False)


@dataclass
class Machine:
    """A network namespace with its own shared memory."""

    name: str
    memory: Path

    def inside(self) -> list[str]:
        """Return the command that runs another on this machine."""
        alone = ['unshare', '--mount', '--ipc', 'sh', '-c', ALONE, 'sh', str(self.memory)]
        return ['ip', 'netns', 'exec', self.name, *alone]

    def start(self, *command: str) -> subprocess.Popen[str]:
        environment = {
            **os.environ,
            'PYTHONPATH': str(ROOT),
            'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET',
        }
        return subprocess.Popen(
            [*self.inside(), sys.executable, *command],
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )


@pytest.fixture
def machines(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Machine, Machine]]:
    """Return two namespaces with a cable between them."""
    if not shutil.which('ip') or not shutil.which('unshare'):
        pytest.skip('needs ip (iproute2) and unshare (util-linux)')
    names = [f'gait{os.getpid()}{side}' for side in 'ab']
    try:
        made = [run('ip', 'netns', 'add', name) for name in names]
        cable = run('ip', 'link', 'add', names[0][-15:], 'netns', names[0],
                    'type', 'veth', 'peer', 'name', names[1][-15:], 'netns', names[1])  # fmt: skip
        refused = [done.stderr.strip() for done in (*made, cable) if done.returncode]
        if refused:
            pytest.skip(f'network namespaces are not allowed here: {refused[0]}')
        for number, name in enumerate(names, 1):
            ip = ('ip', '-n', name)
            for command in (
                ('link', 'set', 'lo', 'up'),
                ('address', 'add', f'10.77.0.{number}/24', 'dev', name[-15:]),
                ('link', 'set', name[-15:], 'up'),
                # Discovery is by multicast.
                ('route', 'add', '224.0.0.0/4', 'dev', name[-15:]),
            ):
                done = run(*ip, *command)
                assert not done.returncode, done.stderr
        pair = [Machine(name, tmp_path_factory.mktemp(name)) for name in names]
        tried = run(*pair[0].inside(), 'true')
        if tried.returncode:
            pytest.skip(f'mount namespaces are not allowed here: {tried.stderr.strip()}')
        yield pair[0], pair[1]
    finally:
        for name in names:
            run('ip', 'netns', 'delete', name)


def test_masks_come_across_the_network(
    machines: tuple[Machine, Machine], bank_file: Path, tmp_path: Path
) -> None:
    robot, desk = machines
    for index, frame in enumerate(clip()):
        cv2.imwrite(str(tmp_path / f'{index:02d}.png'), frame.image)
    box = box_of(clip()[0])
    start = f'initial_box:=[{box.x}.0, {box.y}.0, {box.width}.0, {box.height}.0]'
    bank = ('--ros-args', '-p', f'bank:={bank_file}')
    probe = desk.start('-c', PROBE)
    others = [
        robot.start('-m', 'gait_segmentation.nodes.tracker_node', *bank, '-p', start),
        desk.start('-m', 'gait_segmentation.nodes.matcher_node', *bank),
        desk.start('-m', 'gait_segmentation.nodes.segmenter_node'),
        robot.start('-m', 'gait_tools.cli.source', str(tmp_path), '--rate', '8',
                    '--loop', '--wait-for', '2', '--wait-timeout', str(TIMEOUT_S), '--delay', '2'),
    ]  # fmt: skip
    try:
        output, _ = probe.communicate(timeout=TIMEOUT_S + 30)
        assert all(process.poll() is None for process in others)
    finally:
        for process in (probe, *others):
            process.kill()
            process.communicate()
    seen = json.loads(output.splitlines()[-1])
    assert sum(most > 0 for _, _, most in seen) >= MASKS
    assert {(name, width) for name, width, _ in seen} == {('camera', clip()[0].image.shape[1])}

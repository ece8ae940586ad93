# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Taking part in the graph before there is a node, each time in a process of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TIMEOUT_S = 300
BEGIN = """
import os, sys, time
from gait_segmentation.ros import participant
participant.remove_dead_segments = lambda: 0
"""
HEAVY = """
participant.take_part_early()
print(sorted({'cv2', 'numba'} & set(sys.modules)))
"""
NODE = """
participant.take_part_early()
import rclpy
from rclpy.node import Node
mine = participant.take_part(['given', 'later'])
node = Node('walker', use_global_arguments=False)
def seen():
    # Others may be in the domain.
    names = [each.replace(str(os.getpid()), 'PID') for each in node.get_node_names()]
    return sorted({'_gait_PID', 'walker'} & set(names))
print(seen())
mine.has_node()
while len(seen()) > 1:
    time.sleep(0.01)
print(seen())
mine.close()
node.destroy_node()
rclpy.shutdown()
"""
WRONG = """
sys.argv = ['gait_tracker', '--ros-args', '-r', 'nonsense']
participant.take_part_early()
import rclpy
print(rclpy.ok())
try:
    participant.take_part(sys.argv)
except Exception as error:
    print('nonsense' in str(error))
"""


def run(script: str) -> list[str]:
    done = subprocess.run(
        [sys.executable, '-c', BEGIN + script],
        cwd=ROOT,
        # Without shared memory, of which Fast DDS writes errors to the standard output.
        env={**os.environ, 'FASTDDS_BUILTIN_TRANSPORTS': 'UDPv4'},
        capture_output=True,
        text=True,
        timeout=TIMEOUT_S,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def test_nothing_that_takes_long_is_imported_before() -> None:
    assert run(HEAVY) == ['[]']


def test_a_hidden_node_stands_for_the_one_to_come() -> None:
    assert run(NODE) == ["['_gait_PID', 'walker']", "['walker']"]


def test_what_is_wrong_is_said_when_it_is_asked_for() -> None:
    assert run(WRONG) == ['False', 'True']

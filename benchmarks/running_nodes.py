# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The nodes as benchmarks and fuzzers have them: started, connected and measured."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path

from sensor_msgs.msg import Image

from gait_segmentation.geometry import Box
from gait_tools.demo.nodes import NODES, Listener, ProcessError, ProcessGroup, ros

STYLES = {'split': NODES, 'single': ('gait_pipeline',)}
ALL_NODES = (*NODES, 'gait_pipeline')

LINKS = {'box': 1, 'likelihood': 2, 'matched_box': 2, 'shape_prior': 2, 'mask': 1}
"""Subscribers that the topics of a person have when the three nodes are connected."""

START_TIMEOUT_S, _POLL_S = 180.0, 0.02


def connected(listener: Listener, nodes: tuple[str, ...]) -> bool:
    """Tell whether nodes are active and connected with each other and with who hears the mask."""
    wanted = {f'person_0/{topic}': count for topic, count in LINKS.items()}
    wanted = {'mask': 1} | (wanted if len(nodes) > 1 else {})
    return listener.active() >= set(nodes) and all(
        listener.subscribers(topic) >= count for topic, count in wanted.items()
    )


def processor_seconds(pid: int) -> float:
    """Return the processor time a process has taken."""
    fields = Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')


def resident_mib(pid: int) -> float:
    """Return the resident memory of a process, NaN if it has just ended."""
    try:
        pages = Path(f'/proc/{pid}/statm').read_text().split()
    except FileNotFoundError:
        pages = []
    return int(pages[1]) * os.sysconf('SC_PAGE_SIZE') / 2**20 if pages else float('nan')


def wait(done: Callable[[], bool], timeout_s: float, poll_s: float = _POLL_S) -> bool:
    """Wait until something is so; return whether it is."""
    deadline = time.monotonic() + timeout_s
    while not done():
        if time.monotonic() > deadline:
            return False
        time.sleep(poll_s)
    return True


@contextmanager
def session() -> Iterator[tuple[ProcessGroup, Listener]]:
    """Have processes, and who listens to the mask as a user would."""
    with (
        ros(),
        tempfile.TemporaryDirectory() as logs,
        ProcessGroup(Path(logs)) as processes,
        closing(Listener({'mask': Image})) as listener,
    ):
        yield processes, listener


def start(
    processes: ProcessGroup,
    nodes: tuple[str, ...],
    listener: Listener,
    *parameters: str,
    box: Box | None = None,
    preset: Path | None = None,
) -> None:
    """
    Start nodes and wait until they are active and connected.

    :param parameters: of all nodes, as ``name:=value``.
    :param box: of a person in the first frame; without, people are found.
    :param preset: the parameter file of all nodes, if any.
    """
    for name in nodes:
        given = list(parameters)
        if box is not None and name in ('gait_tracker', 'gait_pipeline'):
            numbers = f'{box.x:.2f}, {box.y:.2f}, {box.width:.2f}, {box.height:.2f}'
            given.append(f'initial_box:=[{numbers}]')
        words = [word for each in given for word in ('-p', each)]
        if preset is not None:
            words = ['--params-file', str(preset), *words]
        processes.start_node(name, '--ros-args', *words)

    def ready() -> bool:
        processes.check_running(*nodes)
        return connected(listener, nodes)

    if not wait(ready, START_TIMEOUT_S):
        raise ProcessError('the nodes did not connect')

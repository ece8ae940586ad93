# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A film as a live camera before the three nodes as processes, and what they publish."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import lz4.block
import numpy as np
from geometry_msgs.msg import PolygonInstanceStamped
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from numpy.typing import NDArray
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import Image, JointState
from tqdm import tqdm

from gait_segmentation.cli.tool import POLL_S, preset_file
from gait_segmentation.geometry import Box
from gait_segmentation.inputs import ImageSource
from gait_segmentation.inputs.encodings import read_mono8
from gait_segmentation.pipeline import FrameResult, PersonResult
from gait_segmentation.results import MatchResult, SegmentationResult, TrackResult
from gait_segmentation.streams.fields import (
    read_body,
    read_box,
    read_gait,
    slot_topic,
    slot_topics,
)
from gait_tools.demo.nodes import NODES, Listener, ProcessError, ProcessGroup, ros

_START_TIMEOUT_S = 900.0
_FLOW_OUT_S = 5.0
_RECORDED = {'box': PolygonInstanceStamped, 'matched_box': PolygonInstanceStamped}
_RECORDED |= {'gait': JointState}
_SUBSCRIBERS = {'box': 2, 'likelihood': 2, 'matched_box': 3, 'shape_prior': 2, 'gait': 2}
_SUBSCRIBERS |= {'mask': 1}
"""Of the topics of a slot, when the nodes and who records them are connected."""


def read_stamps(path: Path) -> dict[int, int]:
    """Return what ``gait_source --stamps`` has written: stamps in nanoseconds by frame number."""
    pairs = (line.split() for line in path.read_text(encoding='ascii').splitlines())
    return {int(number): int(stamp_ns) for number, stamp_ns in pairs}


class Recording(Listener):
    """
    What the nodes publish of the frames of a film.

    ``published`` has the stamps in ns of all frames by number, once the film was played,
    ``arrived_s`` the times at which labels came by stamp; of ``complete`` frames all has come.
    """

    def __init__(self, people: int) -> None:
        """Begin to listen to the nodes; rclpy must be initialised."""
        self.published: dict[int, int] = {}
        self.complete = 0
        self._people = people
        self._kept: dict[int, dict[str, bytes]] = {}
        self._kinds: dict[str, Any] = {'labels': Image, **slot_topics(_RECORDED, people)}
        self._latest_s = 0.0
        super().__init__(self._kinds)

    def heard(self, topic: str, stamp_ns: int, frame_id: str, message: bytes) -> None:
        """Keep a message as it came, in little memory."""
        self._latest_s = time.monotonic()
        if topic == 'labels':
            super().heard(topic, stamp_ns, frame_id, message)
        kept = self._kept.setdefault(stamp_ns, {})
        self.complete += topic not in kept and len(kept) + 1 == len(self._kinds)
        kept[topic] = lz4.block.compress(message)

    def connected(self) -> bool:
        """Return whether the nodes are active and connected with each other and with this."""
        wanted = {'labels': 1, **slot_topics(_SUBSCRIBERS, self._people)}
        return self.active() >= set(NODES) and all(
            self.subscribers(topic) >= count for topic, count in wanted.items()
        )

    def follow(self, done: Callable[[], bool], processes: ProcessGroup) -> None:
        """
        Listen until something is so.

        :raises ProcessError: if a node ends meanwhile.
        """
        while not done():
            processes.check_running(*NODES)
            time.sleep(POLL_S)

    def follow_rest(self, processes: ProcessGroup) -> None:
        """Listen until all frames that were published have come, or nothing comes any more."""
        self._latest_s = time.monotonic()

        def over() -> bool:
            quiet = time.monotonic() - self._latest_s > _FLOW_OUT_S
            return quiet or self.complete >= len(self.published)

        self.follow(over, processes)

    def release_held(self) -> None:
        """Deactivate the matcher, so that it publishes what it holds back for the next frames."""
        client = self.node.create_client(ChangeState, 'gait_matcher/change_state')
        if client.wait_for_service(POLL_S):
            transition = Transition(id=Transition.TRANSITION_DEACTIVATE)
            client.call_async(ChangeState.Request(transition=transition))

    def answered(self) -> list[int]:
        """Return the numbers of the frames whose labels have come."""
        return [number for number, stamp in self.published.items() if stamp in self.arrived_s]

    def dropped(self) -> dict[str, int]:
        """Return how many frames each node says it has dropped, of those that have."""
        with self.lock:
            dropped = {name: int(said.get('dropped', 0)) for name, said in self.status.items()}
        return {name: count for name, count in sorted(dropped.items()) if count}

    def result(self, number: int) -> FrameResult:
        """Return what the nodes said of a frame that was answered."""
        stamp_ns = self.published[number]
        labels = read_mono8(self._message(stamp_ns, 'labels'))
        people = tuple(self._person(stamp_ns, slot, labels) for slot in range(self._people))
        return FrameResult(stamp_ns, people, _mask(labels > 0), labels, {})

    def _person(self, stamp_ns: int, slot: int, labels: NDArray[np.uint8]) -> PersonResult:
        box, matched, gait = (
            self._message(stamp_ns, slot_topic(slot, each)) for each in _RECORDED
        )
        track_id, (tight, tilt) = int(box.polygon.id), read_box(box)
        phase, _, azimuth, _ = read_gait(gait)
        unseen = np.zeros((0, 0), np.uint8)
        match = replace(
            MatchResult.empty(stamp_ns, track_id, unseen.shape),
            body=read_body(matched),
            phase=phase,
            azimuth=azimuth,
        )
        track = TrackResult(stamp_ns, track_id, tight, unseen, 0.0, tilt)
        mask = _mask(labels == slot + 1)
        return PersonResult(track, match, SegmentationResult(stamp_ns, track_id, mask, ''))

    def _message(self, stamp_ns: int, topic: str) -> Any:
        """Return a message, an empty one if it has not come."""
        kind, data = self._kinds[topic], self._kept[stamp_ns].get(topic)
        return kind() if data is None else deserialize_message(lz4.block.decompress(data), kind)


def _mask(inside: NDArray[np.bool_]) -> NDArray[np.uint8]:
    return np.where(inside, 255, 0).astype(np.uint8)


def play(
    film: ImageSource,
    logs: Path,
    *,
    box: Box | None = None,
    people: int = 1,
    preset: str = 'default',
    detector: str = 'boxes',
    **reading: object,
) -> Recording:
    """
    Play a film to the nodes and record what they answer.

    :param logs: folder for what the processes say.
    :param box: of a person in the first frame, in the pixels played; without, people are found.
    :param detector: value of ``detector.network``.
    :param reading: arguments of :func:`open_input` with which the film was opened.
    :raises ProcessError: if a process fails or the nodes do not connect.
    """
    # As gait_segmentation.launch.py does; on a busy computer frames are to be late, not lost.
    words = ['--ros-args', '--params-file', str(preset_file(preset)), '-p', 'backlog:=90']
    words += ['-p', 'keep_images:=300', '-p', f'max_people:={people}']
    words += ['-p', f'detector.network:={detector}']
    if box is not None:
        numbers = [float(each) for each in (box.x, box.y, box.width, box.height)]
        words += ['-p', f'initial_box:={numbers}']
    with ros(), ProcessGroup(logs) as processes:
        with closing(Recording(people)) as recording:
            for name in NODES:
                processes.start_node(name, *words)
            record(recording, processes, film, logs / 'stamps.txt', reading)
        return recording


def record(
    recording: Recording,
    processes: ProcessGroup,
    film: ImageSource,
    stamps: Path,
    reading: dict[str, object],
) -> None:
    """Play the film to the nodes, and wait until everything has come."""
    print('gait_demo: starting the nodes (the first time, up to a minute)', file=sys.stderr)
    deadline = time.monotonic() + _START_TIMEOUT_S

    def connected() -> bool:
        if time.monotonic() > deadline:
            raise ProcessError(f'the nodes did not connect within {_START_TIMEOUT_S:g} s')
        return recording.connected()

    recording.follow(connected, processes)
    source = [f'--{name.replace("_", "-")}={value}' for name, value in reading.items() if value]
    # The delay is for the processes to be done with finding the camera before it starts.
    # All nodes but the matcher read images.
    source += [f'--wait-for={len(NODES) - 1}', '--delay=1', f'--stamps={stamps}']
    source += ['--', str(film.path)]
    stamps.unlink(missing_ok=True)
    processes.start('gait_source', 'gait_tools.cli.source', *source)
    # disable=None: no bar where stderr is not a terminal.
    with tqdm(total=film.total, unit='frame', disable=None, desc='gait_demo') as bar:

        def played() -> bool:
            bar.update(recording.complete - bar.n)
            return processes.ended('gait_source')

        recording.follow(played, processes)
        processes.check_running(*NODES)
        recording.published = read_stamps(stamps)
        recording.follow_rest(processes)
        if recording.complete < len(recording.published):
            recording.release_held()
            recording.follow_rest(processes)

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A film as a live camera before the three nodes as processes, and what they publish."""

from __future__ import annotations

import json
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
from gait_segmentation.encodings import read_mono8
from gait_segmentation.geometry import Box
from gait_segmentation.inputs import ImageSource
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


def read_stamps(path: Path) -> dict[int, int]:
    """Return the stamps in ns by frame number that the camera has written."""
    pairs = (line.split() for line in path.read_text(encoding='ascii').splitlines())
    return {int(number): int(stamp_ns) for number, stamp_ns in pairs}


class Recording(Listener):
    """What the nodes publish of the frames of a film; of ``complete`` frames all has come."""

    def __init__(self, people: int) -> None:
        """Begin to listen to the nodes; rclpy must be initialised."""
        self.published: dict[int, int] = {}
        self.complete = 0
        self.latest_s = 0.0
        self._people = people
        self._kept: dict[int, dict[str, bytes]] = {}
        self._kinds: dict[str, Any] = {'labels': Image, **slot_topics(_RECORDED, people)}
        super().__init__(self._kinds)

    def heard(self, topic: str, stamp_ns: int, message: bytes) -> None:
        """Keep a message as it came, in little memory."""
        self.latest_s = time.monotonic()
        if topic == 'labels':
            super().heard(topic, stamp_ns, message)
        kept = self._kept.setdefault(stamp_ns, {})
        self.complete += topic not in kept and len(kept) + 1 == len(self._kinds)
        kept[topic] = lz4.block.compress(message)

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
    detector: str | None = None,
    **reading: object,
) -> Recording:
    """Play an opened film to the nodes and record what they answer."""
    # As gait_segmentation.launch.py does; on a busy computer frames are to be late, not lost: with
    # best effort nobody would know whether a node has the last ones before the camera ends.
    words = ['--ros-args', '--params-file', str(preset_file(preset)), '-p', 'backlog:=90']
    words += ['-p', 'reliability:=reliable', '-p', 'keep_images:=300']
    words += ['-p', f'max_people:={people}']
    if detector is not None:
        words += ['-p', f'detector.network:={detector}']
    if box is not None:
        numbers = [float(each) for each in (box.x, box.y, box.width, box.height)]
        words += ['-p', f'initial_box:={numbers}']
    with ros(), ProcessGroup(logs) as processes, closing(Recording(people)) as recording:
        for name in NODES:
            processes.start_node(name, *words)

        def follow(done: Callable[[], bool]) -> None:
            while not done():
                processes.check_running(*NODES)
                time.sleep(POLL_S)

        print('gait_demo: starting the nodes (the first time, up to a minute)', file=sys.stderr)
        deadline = time.monotonic() + _START_TIMEOUT_S
        follow(lambda: recording.connected(NODES, people) or time.monotonic() > deadline)
        if time.monotonic() > deadline:
            raise ProcessError(f'the nodes did not connect within {_START_TIMEOUT_S:g} s')
        # All nodes but the matcher read images.
        stamps, readers = logs / 'stamps.txt', len(NODES) - 1
        stamps.unlink(missing_ok=True)
        about = {'film': str(film.path), 'stamps': str(stamps), 'readers': readers, **reading}
        processes.start('camera', 'gait_tools.demo.camera', json.dumps(about))
        # disable=None: no bar where stderr is not a terminal.
        with tqdm(total=film.total, unit='frame', disable=None, desc='gait_demo') as bar:

            def played() -> bool:
                bar.update(recording.complete - bar.n)
                return processes.ended('camera')

            def over() -> bool:
                quiet = time.monotonic() - recording.latest_s > _FLOW_OUT_S
                return quiet or recording.complete >= len(recording.published)

            follow(played)
            processes.check_running(*NODES)
            recording.published = read_stamps(stamps)
            for finish in (lambda: None, recording.release_held):
                if recording.complete < len(recording.published):
                    finish()
                    recording.latest_s = time.monotonic()
                    follow(over)
        return recording

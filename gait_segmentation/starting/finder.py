# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Finding people who walk, without a box: moving blobs that keep having the shape of a body.

A logistic regression says whether a candidate walks.  ``walking.json`` holds rows of a measure,
its weight and the range it is cut to; two rows of the same measure bend the line at the median of
people.  ``benchmarks/walking.py`` learns it.
"""

from __future__ import annotations

import json
import math
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.config import StageConfig, parameter
from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.geometry import Box
from gait_segmentation.images import tanimoto
from gait_segmentation.scene.scene import Scene
from gait_segmentation.starting.moving import Blob, MotionDetector, MovingRegions
from gait_segmentation.starting.shapes import BodyShapes, normalised

MODEL_FILE = Path(__file__).with_name('walking.json')
_MODEL = json.loads(MODEL_FILE.read_text(encoding='utf-8'))
# Scale and longest side in pixels up to which more is searched for several people.
_CROWD_SCALE = 0.375
_CROWD_SIZE = 480
_LEAST_PERIOD_S = 0.025  # frames that come faster are left out
# A longer pause ends the search; a candidate is kept unseen, one frame speaks, and an earlier
# shape is compared with for so long at most.
_PAUSE_S = 0.4
_SAME_SHARE = 0.4  # share of the smaller of two boxes that is common to boxes of the same person
# Time for which a place is remembered where a person was found that was none, and by how much more
# evidence is asked for in it: people come close to it in some seconds.
_REJECTED_S = 10.0
_STRICTER = 10.0
_SIGHTING_GAIN = 0.4  # share of a sighting in the place, speed and size of a candidate
# Intersection over union with where a candidate is expected from which a blob may be it.
_LEAST_IOU = 0.25
_STEADY_S = 0.1  # least time after which a shape is compared with an earlier one


@dataclass(frozen=True)
class StartingConfig(StageConfig):
    """Parameters of the search for people who walk into free slots."""

    auto_init: str = parameter(
        'detector',
        'How people get a slot without a box: detector = a small network sees them, which is then '
        'asked whether they are still there, too; walk = moving blobs that keep having the shape '
        'of a body; none (or off) = not at all.',
        choices=('detector', 'walk', 'none'),
    )
    search_size: int = parameter(
        256,
        'Longest side of the image that is searched; larger sources are scaled down. For several '
        'people up to 0.375 of the source, at most 480, to find small ones.',
        unit='px',
        minimum=64,
        maximum=480,
        fixed=True,
    )
    least_height: float = parameter(
        20.0,
        'Least height of people who are searched for, in the searched image.',
        unit='px',
        minimum=12.0,
        maximum=400.0,
    )
    least_evidence: float = parameter(
        0.1,
        'Evidence from which a person is taken for a walker: log-odds times the time for which '
        'they are seen. Lower values start earlier, higher ones make fewer errors.',
        unit='s',
        minimum=0.025,
        maximum=100.0,
    )


@dataclass
class Candidate:
    """
    What moves and may be a person.

    ``box`` is its smoothed box in the newest frame, ``trail`` the box of all places where it has
    been, ``speed`` that of its centre against the world in pixels a second.  ``blob`` is what was
    seen of it last, at ``seen`` seconds.  ``shapes`` holds (seconds, normalised shape) of the last
    frames, ``evidence`` the sum of the log-odds that it walks, in seconds, as of ``judged``.
    """

    box: Box
    trail: Box
    blob: Blob
    seen: float
    speed: tuple[float, float] = (0.0, 0.0)
    sightings: int = 1
    shapes: deque[tuple[float, NDArray[np.uint8]]] = field(default_factory=deque)
    evidence: float = 0.0
    judged: float = 0.0

    def predicted(self, seconds: float) -> Box:
        """Return where it should be at a time."""
        passed = seconds - self.seen
        return self.box.shifted(self.speed[0] * passed, self.speed[1] * passed)

    def see(self, blob: Blob, seconds: float) -> None:
        """Take in a sighting."""
        box, before, expected = blob.box, self.box, self.predicted(seconds)
        passed = seconds - self.seen
        dx, dy = box.center_x - expected.center_x, box.center_y - expected.center_y
        gain = max(_SIGHTING_GAIN, 1 / (self.sightings + 1))
        self.speed = self.speed[0] + gain * dx / passed, self.speed[1] + gain * dy / passed
        self.box = Box.from_center(
            expected.center_x + gain * dx,
            expected.center_y + gain * dy,
            before.width + gain * (box.width - before.width),
            before.height + gain * (box.height - before.height),
        )
        self.trail = self.trail.union(box)
        self.blob, self.seen = blob, seconds
        self.sightings += 1

    def judge(self, measures: Mapping[str, float], seconds: float) -> None:
        """Add up the evidence, see :meth:`WalkerFinder._look`."""
        passed = min(seconds - self.judged, _PAUSE_S) if self.judged else 0.0
        self.judged = seconds
        rows = (
            weight * min(max(measures[name], low), high)
            for name, weight, low, high in _MODEL['rows']
        )
        log_odds = sum(rows, float(_MODEL['intercept']))
        self.evidence = max(self.evidence + passed * log_odds, 0.0)

    def show(self, shape: NDArray[np.uint8]) -> NDArray[np.uint8] | None:
        """Take in the normalised shape of a sighting; return an earlier one if there is one."""
        self.shapes.append((self.seen, shape))
        while self.seen - self.shapes[0][0] > _PAUSE_S:
            self.shapes.popleft()
        first, earlier = self.shapes[0]
        return earlier if self.seen - first >= _STEADY_S else None


def seen_again(
    candidates: Sequence[Candidate], blobs: Sequence[Blob], seconds: float, least_height: float
) -> list[Candidate]:
    """
    Associate the blobs of a frame with candidates, greedily by overlap.

    :returns: the candidates seen of late, and a new one for each blob left that is tall enough.
    """
    pairs = (
        (each.predicted(seconds).iou(blob.box), index, number)
        for index, each in enumerate(candidates)
        for number, blob in enumerate(blobs)
    )
    left = dict(enumerate(blobs))
    for overlap, index, number in sorted(pairs, reverse=True):
        if overlap >= _LEAST_IOU and number in left and candidates[index].seen < seconds:
            candidates[index].see(left.pop(number), seconds)
    kept = [each for each in candidates if seconds - each.seen < _PAUSE_S]
    new = (blob for blob in left.values() if blob.box.height >= least_height)
    return kept + [Candidate(blob.box, blob.box, blob, seconds) for blob in new]


class WalkerFinder:
    """
    Looks for people who walk, at a small size, and returns their boxes once they are sure.

    ``detector`` is what shows it what moves, None while it does not look.  ``judged`` are tight
    boxes in source pixels, and measures, of who was judged in the newest frame.
    """

    def __init__(
        self, bank: TemplateBank, config: StartingConfig | None = None, people: int = 1
    ) -> None:
        """Make a finder that knows nothing of the scene, for so many ``people`` at most."""
        self.config = config or StartingConfig()
        self._people = people
        self._shapes = BodyShapes(bank)
        self.detector: MotionDetector | None = None
        self.stop()

    def stop(self) -> None:
        """Forget all candidates, and let the scene go on without the search."""
        if self.detector is not None:
            self.detector.close()
        self.detector = None
        self._scale, self._stamp_ns = 1.0, 0
        self._candidates: list[Candidate] = []
        self.judged: list[tuple[Box, dict[str, float]]] = []
        self._rejected: list[tuple[Box, float]] = []

    def update(
        self,
        scene: Scene,
        occupied: Sequence[Box] = (),
        *,
        tried: Sequence[Box] = (),
        wanted: bool = True,
    ) -> list[Box]:
        """
        Look at the newest frame of a scene; after a pause it starts again.

        :param scene: the same as before; see :meth:`stop`.
        :param occupied: boxes of people known already, in source pixels.
        :param tried: boxes of people found who are still on probation, likewise.
        :param wanted: whether people are to be found; if not, what moves is followed only.
        :returns: tight boxes of people who walk and are not known, in source pixels.
        """
        pause = (scene.stamp_ns - self._stamp_ns) / 1e9
        if self.detector is not None and pause < _LEAST_PERIOD_S:
            return []
        if self.detector is None or pause >= _PAUSE_S:
            self.stop()
            size = max(scene.source)
            searched = float(self.config.search_size)
            if self._people > 1:
                # Finer, as there may be a crowd.
                searched = max(searched, min(_CROWD_SCALE * size, _CROWD_SIZE))
            self._scale = min(1.0, searched / size)
            self.detector = MotionDetector(scene, self._scale)
        self._stamp_ns, seconds = scene.stamp_ns, scene.stamp_ns / 1e9
        taken, doubtful = (
            [box.scaled(self._scale) for box in boxes] for boxes in (occupied, tried)
        )
        frame = self.detector.update(taken)
        # Along with the camera.
        shift = frame.shift
        self._candidates = [
            replace(each, box=each.box.shifted(*shift), trail=each.trail.shifted(*shift))
            for each in self._candidates
        ]
        self._rejected = [
            (box.shifted(*shift), until) for box, until in self._rejected if seconds < until
        ]
        known = [] if frame.fresh else self._candidates
        self._candidates = seen_again(known, frame.blobs, seconds, self.config.least_height)
        self.judged = []
        found = self._look(frame, taken, doubtful, seconds) if wanted else []
        return [box.scaled(1 / self._scale) for box in found]

    def evidence(self, box: Box) -> float:
        """Return that for a walker in a box in source pixels, in times of ``least_evidence``."""
        place = [box.scaled(self._scale)]
        there = (each.evidence for each in self._candidates if belongs(each.box, place))
        return max(there, default=0.0) / self.config.least_evidence

    def reject(self, box: Box) -> None:
        """Ask for more evidence, for a time, where what is in a box in source pixels moves."""
        place = box.scaled(self._scale)
        for number, each in enumerate(self._candidates):
            if each.box.iou(place) > 0:
                place = place.union(each.trail)
                self._candidates[number] = replace(each, evidence=0.0)
        self._rejected.append((place, self._stamp_ns / 1e9 + _REJECTED_S))

    def _look(
        self, frame: MovingRegions, known: Sequence[Box], tried: Sequence[Box], seconds: float
    ) -> list[Box]:
        """
        Add up the evidence of each candidate, and return tight boxes of walkers, tallest first.

        The log-odds of each frame, times the time since the last one, never fall below zero, as in
        Page's cumulative sum test: what is doubtful must walk for longer.  Those on probation, who
        are ``tried``, are judged, but not found again.
        """
        found: list[Box] = []
        seen = [each for each in self._candidates if each.seen == seconds]
        size = frame.silhouettes.shape[::-1]
        shapes = [normalised(frame.silhouettes[each.blob.box.slices(*size)]) for each in seen]
        likeness = [self._shapes.likeness(shape) for shape in shapes]
        rejected = [box for box, _ in self._rejected]
        own = [
            0.0 if belongs(each.blob.box, rejected) else each.blob.area * (1 - alike)
            for each, alike in zip(seen, likeness, strict=True)
        ]
        small = [blob for blob in frame.blobs if all(blob is not each.blob for each in seen)]
        clutter = sum(own) + sum(b.area for b in small if not belongs(b.box, rejected))
        for each, shape, alike, odd in zip(seen, shapes, likeness, own, strict=True):
            blob = each.blob
            if shape is None or belongs(each.box, known):
                continue
            earlier = each.show(shape)
            if earlier is None:
                continue
            measures = {
                'similarity': alike,
                'width': math.log(blob.box.width / blob.box.height),
                'moving': blob.moving / blob.area,
                'height': math.log(blob.box.height),
                # With the own shape a moment ago: noise is fleeting, things are rigid.
                'steadiness': float(tanimoto(earlier, shape)),
                # What moves elsewhere without being like a body, as a share of the image.
                'clutter': (clutter - odd) / frame.silhouettes.size,
            }
            self.judged.append((blob.box.scaled(1 / self._scale), measures))
            each.judge(measures, seconds)
            needed = self.config.least_evidence
            if belongs(each.box, rejected):
                needed *= _STRICTER
            if each.evidence >= needed and not belongs(each.box, tried):
                found.append(blob.box)
        return sorted(found, key=lambda box: -box.height)


def belongs(box: Box, known: Sequence[Box]) -> bool:
    """Tell whether what is in a box may be of a person known, by the share of the smaller box."""
    for other in known:
        width = min(box.right, other.right) - max(box.x, other.x)
        height = min(box.bottom, other.bottom) - max(box.y, other.y)
        smaller = min(box.width * box.height, other.width * other.height)
        if min(width, height) > 0 and width * height / smaller > _SAME_SHARE:
            return True
    return False

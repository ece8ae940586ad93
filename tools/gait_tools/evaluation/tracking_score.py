# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
How well people are followed: silhouettes, boxes and identities, as docs/evaluation.md says.

As in CLEAR-MOT (Bernardin and Stiefelhagen, 2008) who is held stays with the track as long as the
boxes overlap; others are given to free tracks by greatest overlap.  A track in a frame is false if
its box is nobody's and its mask (without one, its box) lies less than half in ambiguous pixels.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import Box
from gait_segmentation.people import MOST_PEOPLE
from gait_tools.evaluation.metrics import (
    LOST_IOU,
    centre_distance,
    jaccard,
    mean_known,
    truth_of,
    window_about,
)

if TYPE_CHECKING:  # which takes long to load
    from gait_segmentation.pipeline import PersonResult

SAME_IOU = 0.5  # two boxes that overlap at least this much are of the same person
SEEN_SHARE = 0.25  # share of somebody's greatest visible area nearby in time that counts as seen
WHOLE_SHARE = 0.75  # share of it that counts as wholly visible, if the box is clear of the border
NEARBY_SECONDS = 1.0  # how far away in time the greatest visible area is looked for
MISSING = 'MOTA and IDF1 need the Python package motmetrics, which is not installed'
# People and track ids of a frame, and the (people, tracks) IoU of their boxes.
MotFrame = tuple[Sequence[int], Sequence[int], NDArray[np.float64]]
_UNCLEAR_SHARE = 0.5  # of a mask in ambiguous pixels: from there on, nobody knows who is right


class Sighting(NamedTuple):
    """What of a person can be seen in a frame: the tight box and the number of pixels."""

    box: Box
    area: int


class Attendance:
    """The people of a clip: their labels, ascending, and the frames that have truth."""

    def __init__(
        self, frames: Iterable[tuple[int, NDArray[np.uint8]]], fps: float, size: tuple[int, int]
    ) -> None:
        """Go through the frames with truth once: number and labels, ascending."""
        self.fps, self.size = fps, size
        self.numbers: list[int] = []
        self._sightings: dict[int, dict[int, Sighting]] = {}
        for number, labels in frames:
            self.numbers.append(number)
            counts = np.bincount(labels.ravel(), minlength=MOST_PEOPLE + 1)
            for person in map(int, np.flatnonzero(counts[1 : MOST_PEOPLE + 1]) + 1):
                x, y, width, height = cv2.boundingRect((labels == person).astype(np.uint8))
                seen = Sighting(Box(x, y, width, height), int(counts[person]))
                self._sightings.setdefault(person, {})[number] = seen
        self.people = tuple(sorted(self._sightings))
        self._seen = {
            person: [n for n in seen if self._share(person, n) >= SEEN_SHARE]
            for person, seen in self._sightings.items()
        }

    def sighting(self, person: int, number: int) -> Sighting | None:
        """Return what can be seen of a person in a frame, None if nothing."""
        return self._sightings.get(person, {}).get(number)

    def sightings(self, number: int) -> dict[int, Sighting]:
        """Return what can be seen of everybody in a frame."""
        found = {person: self.sighting(person, number) for person in self.people}
        return {person: seen for person, seen in found.items() if seen is not None}

    def seen(self, person: int) -> list[int]:
        """Return the frames in which somebody is not all but hidden, ascending."""
        return self._seen[person]

    def first_whole(self, person: int) -> int | None:
        """Return the first frame that shows all of a person, or, if none does, any of them."""
        width, height = self.size
        seen = self._seen[person]
        for number in seen:
            box = self._sightings[person][number].box
            clear = box.x > 0 and box.y > 0 and box.right < width and box.bottom < height
            if clear and self._share(person, number) >= WHOLE_SHARE:
                return number
        return seen[0] if seen else None

    def returns(self, person: int) -> list[int]:
        """Return the frames in which somebody is seen again after not having been seen."""
        seen = set(self._seen[person])
        known = [number for number in self.numbers if number >= min(seen, default=0)]
        return [b for a, b in itertools.pairwise(known) if a not in seen and b in seen]

    def person_at(self, box: Box, number: int) -> int | None:
        """Return whom a box is about in a frame, None if it is nobody's."""
        overlaps = {p: seen.box.iou(box) for p, seen in self.sightings(number).items()}
        person = max(overlaps, key=lambda p: overlaps[p], default=None)
        return person if person is not None and overlaps[person] >= SAME_IOU else None

    def _share(self, person: int, number: int) -> float:
        seen = self._sightings[person]
        reach = round(NEARBY_SECONDS * self.fps)
        near = (seen.get(other) for other in range(number - reach, number + reach + 1))
        most = max(sighting.area for sighting in near if sighting is not None)
        return seen[number].area / most


def first_frames(attendance: Attendance, starts: Mapping[int, Iterable[Box]]) -> dict[int, int]:
    """Return from which frame on people count: of their box, or the first whole one."""
    since: dict[int, int] = {}
    for number, boxes in sorted(starts.items()):
        for box in boxes:
            person = attendance.person_at(box, number)
            if person is not None:
                since.setdefault(person, number)
    for person in attendance.people:
        whole = attendance.first_whole(person)
        if whole is not None:
            since.setdefault(person, whole)
    return since


@dataclass
class PersonScore:
    """What is known of who counts from ``since`` on; ``held``: frames and ids, of before, too."""

    since: int
    j: list[float] = field(default_factory=list)
    box_iou: list[float] = field(default_factory=list)
    centre_error: list[float] = field(default_factory=list)
    j_of_id: dict[int, float] = field(default_factory=dict)
    held: list[tuple[int, int]] = field(default_factory=list)

    def numbers(self, person: int, attendance: Attendance) -> dict[str, Any]:
        """Return the scores by name; None where there is nothing to measure."""
        fps, whole = attendance.fps, attendance.first_whole(person)
        recoveries: list[float | None] = []
        for number in attendance.returns(person):
            if number > self.since:
                again = next((held for held, _ in self.held if held >= number), None)
                recoveries.append(None if again is None else (again - number) / fps)
        holders = (track_id for number, track_id in self.held if number >= self.since)
        ids = [track_id for track_id, _ in itertools.groupby(holders)]
        lock = None
        if self.held and whole is not None:
            lock = max(self.held[0][0] - whole, 0) / fps
        return {
            'frames': len(self.j),
            'J': mean_known(self.j),
            'J_one_id': max(self.j_of_id.values(), default=0.0) / len(self.j) if self.j else None,
            'box_iou': mean_known(self.box_iou),
            'centre_error': mean_known(self.centre_error),
            'lost_frames': sum(iou < LOST_IOU for iou in self.box_iou),
            'id_switches': max(len(ids) - 1, 0),
            'ids': ids,
            'lock_seconds': lock,
            'recovery_seconds': recoveries,
        }


class TrackingScore:
    """Takes in what was found frame by frame and says how well people were followed."""

    def __init__(self, attendance: Attendance, since: Mapping[int, int]) -> None:
        """Begin with the first frame that counts of each person, see :func:`first_frames`."""
        self._attendance = attendance
        self._people = {person: PersonScore(number) for person, number in since.items()}
        self._seen = {person: set(attendance.seen(person)) for person in self._people}
        self._holds: dict[int, int] = {}
        self._ids: set[int] = set()
        self._real_ids: set[int] = set()
        self._false_frames = 0
        self._mot: list[MotFrame] = []

    def add(self, number: int, labels: NDArray[np.uint8], found: Sequence[PersonResult]) -> None:
        """Take in the labels of a frame, and who was found; all have a box."""
        sightings = self._attendance.sightings(number)
        by_id = {each.track.track_id: each for each in found}
        boxes = {i: each.track.box for i, each in by_id.items() if each.track.box is not None}
        iou = {
            (person, track_id): float(seen.box.iou(box))
            for person, seen in sightings.items()
            for track_id, box in boxes.items()
        }
        counted = [
            person
            for person, known in self._people.items()
            if number >= known.since and number in self._seen[person]
        ]
        j: dict[tuple[int, int], float] = {}
        for person in counted:
            window = window_about(sightings[person].box, labels.shape)
            truth = truth_of(labels[window], person)
            for track_id, each in by_id.items():
                j[person, track_id] = jaccard(each.segmentation.mask[window], truth)
        order = sorted(iou, key=lambda pair: (-j.get(pair, 0.0), -iou[pair], pair))
        pairs = dict(_one_to_one(pair for pair in order if j.get(pair, 0) > 0 or iou[pair] > 0))
        for person in counted:
            known = self._people[person]
            suits = pairs.get(person)
            pair = (person, suits or 0)
            known.j.append(j.get(pair, 0.0))
            known.box_iou.append(iou.get(pair, 0.0))
            if suits is not None:
                expected = sightings[person].box
                known.centre_error.append(centre_distance(boxes[suits], expected))
            for other in by_id:
                known.j_of_id[other] = known.j_of_id.get(other, 0.0) + j[person, other]
        self._identify(number, iou)
        self._ids |= set(by_id)
        touched = {track_id for (_, track_id), value in iou.items() if value >= LOST_IOU}
        real = {i for i, each in by_id.items() if i in touched or _unclear(labels, each)}
        self._real_ids |= real
        self._false_frames += len(by_id) - len(real)
        # For MOTA and IDF1, without tracks on people who do not count.
        elsewhere = {i for (p, i), v in iou.items() if p not in counted and v >= SAME_IOU}
        ids = [track_id for track_id in by_id if track_id not in elsewhere]
        overlap = np.array([[iou[person, i] for i in ids] for person in counted], np.float64)
        self._mot.append((counted, ids, overlap.reshape(len(counted), len(ids))))

    def numbers(self) -> dict[str, Any]:
        """Return the scores by name; None where there is nothing to measure."""
        people = {
            str(person): known.numbers(person, self._attendance)
            for person, known in sorted(self._people.items())
        }
        rows = list(people.values())
        shared = {i for i in self._ids if sum(i in row['ids'] for row in rows) > 1}
        recoveries = [value for row in rows for value in row['recovery_seconds']]
        locks = [row['lock_seconds'] for row in rows]
        locked, recovered = ([v for v in each if v is not None] for each in (locks, recoveries))
        return {
            'people': people,
            **{
                name: mean_known(row[name] for row in rows)
                for name in ('J', 'J_one_id', 'box_iou', 'centre_error')
            },
            'lost_frames': sum(row['lost_frames'] for row in rows),
            'id_switches': sum(row['id_switches'] for row in rows),
            'shared_ids': len(shared),
            'false_slots': len(self._ids - self._real_ids),
            'false_frames': self._false_frames,
            'lock_seconds': max(locked, default=None),
            'never_locked': len(locks) - len(locked),
            'recovery_seconds': max(recovered, default=None),
            'never_recovered': len(recoveries) - len(recovered),
            **mot_scores(self._mot),
        }

    def _identify(self, number: int, iou: Mapping[tuple[int, int], float]) -> None:
        good = {pair: value for pair, value in iou.items() if value >= SAME_IOU}
        kept = [pair for pair in self._holds.items() if pair in good]
        others = sorted(good, key=lambda pair: (-good[pair], pair))
        now = dict(_one_to_one([*kept, *others]))
        for person, track_id in now.items():
            if person in self._people:
                self._people[person].held.append((number, track_id))
        # Who is hidden for a while stays with the id of before.
        self._holds.update(now)


def accumulated(frames: Iterable[MotFrame]) -> Any:
    """Return the frames as motmetrics takes them."""
    import motmetrics

    accumulator = motmetrics.MOTAccumulator(auto_id=True)
    for people, ids, iou in frames:
        accumulator.update(people, ids, np.where(iou >= SAME_IOU, 1 - iou, np.nan))
    return accumulator


def mot_scores(frames: Sequence[MotFrame]) -> dict[str, float | None]:
    """Return ``mota`` (Bernardin and Stiefelhagen 2008) and ``idf1`` (Ristani et al. 2016)."""
    try:
        import motmetrics
    except ImportError:
        return {}
    if not any(people for people, _, _ in frames):
        return {'mota': None, 'idf1': None}
    scores = motmetrics.metrics.create().compute(
        accumulated(frames), metrics=['mota', 'idf1'], return_dataframe=False
    )
    return {name: float(scores[name]) for name in ('mota', 'idf1')}


def _one_to_one(pairs: Iterable[tuple[int, int]]) -> list[tuple[int, int]]:
    """Take the pairs in order, leaving out those with somebody who is taken."""
    left: set[int] = set()
    right: set[int] = set()
    taken = []
    for first, second in pairs:
        if first not in left and second not in right:
            left.add(first)
            right.add(second)
            taken.append((first, second))
    return taken


def _unclear(labels: NDArray[np.uint8], found: PersonResult) -> bool:
    """Return whether the mask, or without one the box, lies mostly in ambiguous pixels."""
    inside = labels[found.segmentation.mask > 0]
    if inside.size == 0 and found.track.box is not None:
        inside = labels[found.track.box.slices(labels.shape[1], labels.shape[0])].ravel()
    return bool(inside.size) and float((inside > MOST_PEOPLE).mean()) >= _UNCLEAR_SHARE

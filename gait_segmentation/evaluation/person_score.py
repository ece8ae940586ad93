# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How well one person is followed."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

from gait_segmentation.evaluation.attendance import Attendance
from gait_segmentation.evaluation.metrics import LOST_IOU, mean_known
from gait_segmentation.results import FeatureWeight

__all__ = ['PersonScore']


@dataclass
class PersonScore:
    """
    What is known so far of a person who counts from frame ``since`` on.

    ``ids`` are those of the tracks that held the person, one after the other, and ``held`` the
    frames in which one did, also before ``since``.  The other fields are lists with an entry for
    every frame that counts, or sums over them; ``features`` are sums of weights and variance
    ratios over the ``looks``, the frames that have any.
    """

    since: int
    j: list[float] = field(default_factory=list)
    j_of_id: dict[int, float] = field(default_factory=dict)
    box_iou: list[float] = field(default_factory=list)
    centre_error: list[float] = field(default_factory=list)
    lost_frames: int = 0
    ids: list[int] = field(default_factory=list)
    held: list[int] = field(default_factory=list)
    switches: int = 0
    looks: int = 0
    features: dict[str, tuple[float, float]] = field(default_factory=dict)

    def add(self, j: float, box_iou: float) -> None:
        """Take in the overlaps, in a frame that counts, with the track that suits best; or 0."""
        self.j.append(j)
        self.box_iou.append(box_iou)
        self.lost_frames += box_iou < LOST_IOU

    def add_features(self, features: Iterable[FeatureWeight]) -> None:
        """Add up weights and variance ratios, if there are any."""
        features = list(features)
        self.looks += bool(features)
        for each in features:
            weight, ratio = self.features.get(each.name, (0.0, 0.0))
            self.features[each.name] = weight + each.weight, ratio + each.variance_ratio

    def hold(self, number: int, track_id: int) -> None:
        """Note that a track holds the person in a frame."""
        self.held.append(number)
        if number < self.since:
            return
        self.switches += bool(self.ids) and self.ids[-1] != track_id
        if not self.ids or self.ids[-1] != track_id:
            self.ids.append(track_id)

    def numbers(self, person: int, attendance: Attendance) -> dict[str, Any]:
        """Return the scores by name; None where there is nothing to measure."""
        fps = attendance.fps
        whole = attendance.first_whole(person)
        lock = None
        if self.held and whole is not None:
            lock = max(self.held[0] - whole, 0) / fps
        recoveries: list[float | None] = []
        for number in attendance.returns(person):
            if number <= self.since:
                continue
            again = next((held for held in self.held if held >= number), None)
            recoveries.append(None if again is None else (again - number) / fps)
        frames = len(self.j)
        best = max(self.j_of_id.values(), default=0.0)
        return {
            'frames': frames,
            'J': mean_known(self.j),
            'J_one_id': best / frames if frames else None,
            'box_iou': mean_known(self.box_iou),
            'centre_error': mean_known(self.centre_error),
            'lost_frames': self.lost_frames,
            'id_switches': self.switches,
            'ids': self.ids,
            'lock_seconds': lock,
            'recovery_seconds': recoveries,
            'features': {
                name: {'weight': weight / self.looks, 'variance_ratio': ratio / self.looks}
                for name, (weight, ratio) in sorted(
                    self.features.items(), key=lambda item: (-item[1][0], -item[1][1])
                )
            },
        }

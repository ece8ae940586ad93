# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Who was detected and is not tracked: not yet taken for a person, or without room."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from gait_segmentation.detector.detection import Detection, SoftMask, associate
from gait_segmentation.geometry import Box
from gait_segmentation.scene.ego_motion import WorldMotion
from gait_segmentation.tracking.existence import Existence
from gait_segmentation.tracking.track import Track

_KEPT_NS = 1_000_000_000
"""Time for which somebody is remembered whom the detector does not see any more."""

_THING_NS = 30_000_000_000
"""The same of what did not move for so long that it is no person."""

_UNLIKELY = -3.0
"""Log-odds up to which somebody is not looked for more often: one in twenty is a person."""

_COMPARED_NS = 500_000_000
"""Time after which somebody may look otherwise."""

_DRAWN = 0.4
"""Score from which somebody is drawn: below, boxes are often of a part."""


@dataclass(frozen=True)
class Tentative:
    """
    A tentative track: somebody whom detections tell of, and no pixels yet.

    ``detection`` is the last one, of the frame of ``stamp_ns``.  What was tracked and is
    ``rejected``, as it did not move, is remembered for longer.  At ``drawn_ns`` they were last
    drawn, and at ``compared_ns`` compared with those who are lost.
    """

    detection: Detection
    stamp_ns: int
    existence: Existence
    rejected: bool = False
    drawn_ns: int = 0
    compared_ns: int = 0

    @classmethod
    def rejected_of(cls, track: Track, stamp_ns: int) -> Tentative:
        """Return a track that is no person, to be known as that."""
        thing = Detection(track.detected_in(stamp_ns), 0.0)
        return cls(thing, stamp_ns, track.existence, rejected=True)

    def carried(self, motion: WorldMotion) -> Tentative:
        """Return it where the world has moved it, by a motion in source pixels."""
        box = self.detection.box
        x, y = motion.carry(box.center_x, box.center_y)
        box = box.shifted(x - box.center_x, y - box.center_y)
        return replace(self, detection=replace(self.detection, box=box))

    def seen(self, detection: Detection, stamp_ns: int, longest: int, *, moves: bool) -> Tentative:
        """
        Go on with the next detection.

        :param longest: the longer side of the image.
        :param moves: whether something moves against the world in its box.
        """
        existence = self.existence.seen(detection.score, detection.box.height / longest)
        if moves:
            existence = existence.moving(stamp_ns, 1.0)
        return replace(self, detection=detection, stamp_ns=stamp_ns, existence=existence)

    def may_be(self, stamp_ns: int) -> bool:
        """Return whether it may soon be known to be a person."""
        return not self.rejected and self.existence.log_odds(stamp_ns) > _UNLIKELY

    def is_to_be_drawn(self, stamp_ns: int) -> bool:
        """Return whether a mask is to tell whether it is a person, as who is taken for one."""
        seen = self.detection.score >= _DRAWN or self.existence.is_person(stamp_ns)
        due = self.may_be(stamp_ns) or stamp_ns - self.drawn_ns >= _COMPARED_NS
        return seen and due and not self.detection.by_map

    def drawn(self, box: Box, mask: SoftMask, stamp_ns: int, longest: int) -> Tentative:
        """
        Take in a mask of who was detected last, and the box in the frame of that.

        :param longest: the longer side of the image.
        """
        detection = replace(self.detection, box=box, mask=mask)
        existence = self.existence.drawn(mask.presence, box.height / longest)
        return replace(self, detection=detection, existence=existence, drawn_ns=stamp_ns)

    def was_compared(self, stamp_ns: int) -> bool:
        """Return whether they were compared of late with those who are lost."""
        return stamp_ns - self.compared_ns < _COMPARED_NS

    def is_over(self, stamp_ns: int) -> bool:
        """Return whether they are to be forgotten."""
        return stamp_ns - self.stamp_ns > (_THING_NS if self.rejected else _KEPT_NS)


def follow(
    known: Sequence[Tentative],
    detections: Sequence[Detection],
    stamp_ns: int,
    longest: int,
    moves: Callable[[Box], bool],
) -> tuple[list[Tentative], list[Tentative]]:
    """
    Go on with tentative tracks by what was detected in the frame of a stamp.

    :param detections: of nobody who is tracked.
    :param longest: the longer side of the image in pixels.
    :param moves: whether something moves against the world in a box.
    :returns: those who were detected, and the others.
    """
    pairs = associate([[each.detection.box] for each in known], detections)
    others = [each for number, each in enumerate(known) if number not in pairs]
    seen = [(known[number], detections[each]) for number, each in pairs.items()]
    for number, each in enumerate(detections):
        if number not in pairs.values():
            seen.append((Tentative(each, stamp_ns, Existence(stamp_ns)), each))
    found = [one.seen(each, stamp_ns, longest, moves=moves(each.box)) for one, each in seen]
    return found, others

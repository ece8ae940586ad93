# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which detection is of which track, and which ones are of somebody new."""

from __future__ import annotations

from collections.abc import Sequence

from gait_segmentation.detector.detection import PART, Detection, associate
from gait_segmentation.detector.sources import Seen
from gait_segmentation.geometry import Box
from gait_segmentation.results import LOST, TRACKED
from gait_segmentation.tracking.track import Track

_INSIDE = 0.7
"""Share of the smaller of two boxes in one look from which they are of the same person."""

_FOUND_AGAIN = 0.6
"""Score of a detection that shows a person who is lost: something like one may be anywhere."""


def associate_beside(
    lost: Sequence[Sequence[Box]],
    tracked: Sequence[Sequence[Box]],
    detections: Sequence[Detection],
) -> dict[int, int]:
    """
    Give detections to tracks beside those who are lost, who may be seen where they are expected.

    Nobody who is tracked goes without a detection for it: who is lost may still be hidden.

    :param lost: see :func:`associate`; that of one of them stays free, to be looked at closer.
    :param tracked: likewise.
    :returns: the numbers of detections by those of tracked ones.
    """
    pairs = associate([*tracked, *lost], detections)
    own = {track: number for track, number in pairs.items() if track < len(tracked)}
    return associate(tracked, detections, own)


def unexplained(
    detections: Sequence[Detection],
    pairs: dict[int, int],
    tracks: Sequence[Sequence[Box]],
) -> list[Detection]:
    """
    Return the detections of nobody who is tracked.

    Two who touch are two; but what is inside of another detection, or a part of a track without
    one, is not somebody else.

    :param pairs: see :func:`associate`.
    :param tracks: likewise.
    """
    matched = [detections[number].box for number in pairs.values()]
    missed = [box for track, boxes in enumerate(tracks) if track not in pairs for box in boxes]
    return [
        each
        for each in _free(detections, pairs)
        if all(each.box.common_share(box) <= _INSIDE for box in matched)
        and all(each.box.common_share(box) <= PART for box in missed)
    ]


def _free(detections: Sequence[Detection], pairs: dict[int, int]) -> list[Detection]:
    """Return the detections that no track has; see :func:`associate`."""
    return [each for number, each in enumerate(detections) if number not in pairs.values()]


def explain(tracks: Sequence[Track], seen: Seen) -> list[Detection]:
    """
    Give detections to tracks, each in the frame that they are of, and return those of others.

    Of whom a detector looked for and did not see, that is taken in as well.
    """
    if seen.people is None:
        return []
    tracked = [track for track in tracks if track.state == TRACKED]
    lost = [track for track in tracks if track.state == LOST]
    expected = {track: track.boxes_at(seen.stamp_ns) for track in tracks}
    bodies = [expected[track] for track in tracked]
    pairs = associate_beside([expected[track] for track in lost], bodies, seen.people)
    # Where they were seen last comes second: that may have been somebody beside them.
    before = [track.detected_in(seen.stamp_ns) for track in tracked]
    pairs = associate([[box] for box in before], seen.people, pairs)
    for number, track in enumerate(tracked):
        if number in pairs:
            track.see(seen.people[pairs[number]], seen.stamp_ns)
        elif track.body.height >= seen.least_height and not associate(
            [expected[track]], seen.people
        ):
            track.overlook()
    sure = [each for each in _free(seen.people, pairs) if each.score >= _FOUND_AGAIN]
    for track in lost:
        if associate([expected[track]], sure):
            track.resume()
    there = [[*boxes, box] for boxes, box in zip(bodies, before, strict=True)]
    return unexplained(seen.people, pairs, there)

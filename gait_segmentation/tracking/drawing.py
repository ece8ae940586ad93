# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Who is drawn in the newest frame, while there is time: who is new, and then who is known."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Protocol

from gait_segmentation.detector.detection import SoftMask
from gait_segmentation.geometry import Box
from gait_segmentation.tracking.tentative import Tentative
from gait_segmentation.tracking.track import Track

_OTHER = 0.5
"""Least intersection over union of a mask and where somebody is expected who was not asked for."""


class Draw(Protocol):
    """Draws people in the newest frame; see :meth:`.DetectorScheduler.draw`."""

    def __call__(self, people: Sequence[Box], *, always: bool = False) -> list[SoftMask]:
        """Return the masks of the first of them."""


def draw_new(
    draw: Draw, found: Sequence[Tentative], stamp_ns: int, longest: int, *, late: bool
) -> list[Tentative]:
    """
    Return tentative tracks that were just detected with their masks, as far as there is time.

    :param stamp_ns: of the newest frame.
    :param longest: its longer side.
    :param late: whether they were detected in an earlier one.
    """
    wanted: list[Tentative] = []
    others: list[Tentative] = []

    def known(each: Tentative) -> tuple[bool, float]:
        return each.existence.present is not None, -each.existence.log_odds(stamp_ns)

    # Of whom there is a mask it is known already whether they are people.
    for each in sorted(found, key=known):
        (wanted if each.is_to_be_drawn(stamp_ns) else others).append(each)
    masks, drawn = draw([each.detection.box for each in wanted]), []
    for each, mask in zip(wanted, masks, strict=False):
        box, there = each.detection.box, _found_again(draw, mask) if late else mask
        if there is not None:
            box = (there.box or box) if late else box
            drawn.append(each.drawn(box, there, stamp_ns, longest))
    return [*drawn, *wanted[len(masks) :], *others]


def draw_known(draw: Draw, tracked: Iterable[Track], stamp_ns: int) -> None:
    """
    Have people drawn who are tracked, those with a slot twice as often as others.

    Where somebody is hidden a network draws who hides them: then the mask is theirs.
    """

    def need(track: Track) -> float:
        return (stamp_ns - track.masked_ns) * (0.5 if track.slot is None else 1.0)

    known = sorted(tracked, key=need, reverse=True)
    boxes = [track.detected_in(stamp_ns) for track in known]
    for track, mask, box in zip(known, draw(boxes), boxes, strict=False):
        shown = _shown(mask, track, known)
        track.take_mask(mask if shown is track else None, box)
        if shown.masked_ns < stamp_ns:
            shown.take_mask(mask, shown.detected_in(stamp_ns))


def _shown(mask: SoftMask, track: Track, known: Sequence[Track]) -> Track:
    """Return whom a mask shows that was drawn for a track."""

    def likeness(each: Track) -> float:
        return mask.iou(each.expected_mask(), each.window, each.view.scale)

    others = [each for each in known if each is not track and mask.fits(each.box)]
    if not others:
        return track
    other = max(others, key=likeness)
    return other if likeness(other) > max(_OTHER, likeness(track)) else track


def _found_again(draw: Draw, mask: SoftMask) -> SoftMask | None:
    """
    Return the mask of somebody who was detected in an earlier frame where they are now, if any.

    :param mask: in their box of then; it shows them though they have left that by their own width.
    """
    if (box := mask.box) is None:
        return None
    (mask,) = draw([box], always=True)
    return mask if mask.fits(box) else None

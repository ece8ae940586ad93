# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Who is drawn in the newest frame, while there is time: who is new, and then who is known."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Protocol

from gait_segmentation.detector.detection import Detection, SoftMask
from gait_segmentation.geometry import Box
from gait_segmentation.tracking.track import Track

_DRAWN = 0.4
"""Score from which a person who is not known yet is drawn."""


class Draw(Protocol):
    """Draws people in the newest frame; see :meth:`.DetectorScheduler.draw`."""

    def __call__(self, people: Sequence[Box], *, always: bool = False) -> list[SoftMask]:
        """Return the masks of the first of them."""


def draw_new(draw: Draw, new: Sequence[Detection], *, late: bool) -> list[Detection]:
    """
    Return people whom nobody tracks with their masks, as far as there is time.

    :param new: the best first.
    :param late: whether they were detected in an earlier frame.
    """
    masks = draw([each.box for each in new if each.score >= _DRAWN])
    drawn = [
        _found_again(draw, each, mask) if late else replace(each, mask=mask)
        for each, mask in zip(new, masks, strict=False)
    ]
    return [*(each for each in drawn if each is not None), *new[len(masks) :]]


def draw_known(draw: Draw, tracked: Iterable[Track], stamp_ns: int) -> None:
    """Have people drawn who are tracked, those with a slot twice as often as others."""

    def need(track: Track) -> float:
        return (stamp_ns - track.masked_ns) * (0.5 if track.slot is None else 1.0)

    known = sorted(tracked, key=need, reverse=True)
    sought = [track.sought_in(stamp_ns)[-1] for track in known]
    for track, mask, box in zip(known, draw(sought), sought, strict=False):
        track.take_mask(mask, box)


def _found_again(draw: Draw, person: Detection, mask: SoftMask) -> Detection | None:
    """
    Return somebody who was detected in an earlier frame where they are now, if they are.

    A mask shows people though they have left the box by their own width, but no farther.
    """
    if (box := mask.box) is None:
        return None
    (mask,) = draw([box], always=True)
    return replace(person, box=mask.box or box, mask=mask) if mask.fits(box) else None

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The kinds of harder clips, by name."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

import numpy as np

from benchmarks.variants import cameras, company, hiding, order
from benchmarks.variants.made_clip import MadeClip
from gait_segmentation.geometry import Box

__all__ = ['KINDS', 'PAIRED', 'moved_boxes', 'variants_of']

Maker = Callable[[MadeClip], Iterable[MadeClip | None]]
PairMaker = Callable[[MadeClip, MadeClip], Iterable[MadeClip | None]]

BOX_SPREAD = 0.012
"""Standard deviation of a moved box's four sides, in heights."""


def moved_boxes(clip: MadeClip, number: int) -> list[MadeClip]:
    """Return the clip with its start box drawn less carefully, as often as asked."""
    made = []
    for draw in range(number):
        rng = np.random.default_rng([draw, len(clip.frames), round(clip.box.height)])
        left, top, right, bottom = rng.normal(0.0, BOX_SPREAD * clip.box.height, 4)
        x, y = clip.box.x + left, clip.box.y + top
        box = Box(x, y, clip.box.right + right - x, clip.box.bottom + bottom - y)
        made.append(replace(clip, name=f'{clip.name}#{draw}', box=box))
    return made


KINDS: dict[str, Maker] = {
    'plain': lambda clip: [clip],
    'box': lambda clip: moved_boxes(clip, 5),
    'start': order.starts,
    'backwards': order.backwards,
    'skip': order.every_second,
    'flip': cameras.flipped,
    'tilt': cameras.tilted,
    'half': cameras.half_size,
    'double': cameras.double_size,
    'dark': cameras.dark,
    'low': cameras.low_contrast,
    'grey': cameras.grey,
    'jpeg': cameras.compressed,
    'noise': cameras.noisy,
    'blur': cameras.blurred,
    'gain': cameras.changing_gain,
    'shade': cameras.shaded,
    'hidden': hiding.hidden,
}
"""What a kind makes of one clip, by the kind's name."""

PAIRED: dict[str, PairMaker] = {
    'pasted': company.before_other_background,
    'two': company.with_second_person,
}
"""What a kind makes of a clip and another one."""


def variants_of(kind: str, clips: Sequence[MadeClip]) -> list[MadeClip]:
    """
    Return what a kind makes of a clip, or what it makes of a clip and another one.

    :param kind: one of :data:`KINDS`, for one clip, or of :data:`PAIRED`, for two.
    :raises KeyError: if there is no such kind.
    :raises ValueError: if there are more or fewer clips.
    """
    if kind in KINDS:
        (clip,) = clips
        made = KINDS[kind](clip)
    else:
        clip, other = clips
        made = PAIRED[kind](clip, other)
    return [variant for variant in made if variant is not None]

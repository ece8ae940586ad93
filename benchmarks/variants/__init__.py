# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Clips made of sequences with truth, harder than they are: for measuring what holds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from benchmarks.variants.cameras import CAMERAS, hidden
from benchmarks.variants.company import before_other_background, with_second_person
from benchmarks.variants.made_clip import MadeClip
from gait_segmentation.geometry import Box

__all__ = ['KINDS', 'PAIRED', 'MadeClip', 'moved_boxes', 'variants_of']

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


KINDS: dict[str, Callable[[MadeClip], list[MadeClip | None]]] = {
    'plain': lambda clip: [clip],
    'box': lambda clip: [*moved_boxes(clip, 5)],
    # Who left then enters.
    'backwards': lambda clip: [clip.with_frames('', list(clip.frames[::-1]))],
    'skip': lambda clip: [replace(clip, fps=clip.fps / 2).with_frames('', list(clip.frames[::2]))],
    **CAMERAS,
    'hidden': hidden,
}
"""What a kind makes of one clip, by the kind's name."""

PAIRED: dict[str, Callable[[MadeClip, MadeClip], list[MadeClip | None]]] = {
    'pasted': before_other_background,
    'two': with_second_person,
}
"""What a kind makes of a clip and another one."""


def variants_of(kind: str, clips: Sequence[MadeClip]) -> list[MadeClip]:
    """
    Return what a kind makes of a clip, or what it makes of a clip and another one.

    :param kind: one of :data:`KINDS`, for one clip, or of :data:`PAIRED`, for two.
    """
    made = KINDS[kind](*clips) if kind in KINDS else PAIRED[kind](*clips)
    return [variant for variant in made if variant is not None]

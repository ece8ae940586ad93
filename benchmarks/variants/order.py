# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The same frames from another one on, backwards, or fewer of them."""

from __future__ import annotations

from dataclasses import replace

from benchmarks.variants.made_clip import MadeClip
from gait_segmentation.evaluation.restarts import restarts_of

__all__ = ['backwards', 'every_second', 'starts']


def starts(clip: MadeClip) -> list[MadeClip]:
    """Return the runs of the restart score: 14 frames from every tenth on."""
    made = []
    for restart in restarts_of(clip):
        first = restart.numbers[0]
        frames = tuple(clip.frames[number] for number in restart.numbers)
        made.append(replace(clip, name=f'{clip.name}@{first}', frames=frames, box=restart.box))
    return made


def backwards(clip: MadeClip) -> list[MadeClip | None]:
    """Return the clip played backwards: who left then enters."""
    return [clip.with_frames('', list(clip.frames[::-1]))]


def every_second(clip: MadeClip) -> list[MadeClip | None]:
    """Return every second frame, at half the frame rate."""
    return [replace(clip, fps=clip.fps / 2).with_frames('', list(clip.frames[::2]))]

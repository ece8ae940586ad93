# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The same frames from another one on, backwards, or fewer of them."""

from __future__ import annotations

from dataclasses import replace

from gait_segmentation.evaluation.metrics import start_box
from gait_segmentation.evaluation.restarts import RESTART_FRAMES, restart_starts
from gait_segmentation.evaluation.variants.made_clip import MadeClip

__all__ = ['backwards', 'every_second', 'starts']


def starts(clip: MadeClip) -> list[MadeClip]:
    """Return the runs of the restart score: 14 frames from every tenth on."""
    made = []
    for first in restart_starts(clip):
        truth = clip.truth(first)
        box = None if truth is None else start_box(truth)
        if box is not None:
            frames = clip.frames[first : first + RESTART_FRAMES]
            made.append(replace(clip, name=f'{clip.name}@{first}', frames=frames, box=box))
    return made


def backwards(clip: MadeClip) -> list[MadeClip | None]:
    """Return the clip played backwards: who left then enters."""
    return [clip.with_frames('', list(clip.frames[::-1]))]


def every_second(clip: MadeClip) -> list[MadeClip | None]:
    """Return every second frame, at half the frame rate."""
    return [replace(clip, fps=clip.fps / 2).with_frames('', list(clip.frames[::2]))]

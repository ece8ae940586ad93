# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Cues: what tells a person from the surroundings besides colours and background.

A cue is a class in a file of its own, with its memory of one person: :meth:`Cue.evidence` says
what it makes of the pixels of a frame, and :meth:`Cue.learn` takes in the mask of a frame once it
has come back.  Who adds one names it in :func:`new_cues`, and its parameters in the configuration.
"""

from __future__ import annotations

from gait_segmentation.tracking.cues.cue import Cue
from gait_segmentation.tracking.cues.heat_map import HeatMapCue
from gait_segmentation.tracking.cues.motion import MotionCue

__all__ = ['new_cues']


def new_cues(heat_map: HeatMapCue | None = None) -> tuple[Cue, ...]:
    """
    Return the cues of somebody new, in the order in which they are asked.

    :param heat_map: what is known of the heat map already, if anything.
    """
    return MotionCue(), heat_map or HeatMapCue()

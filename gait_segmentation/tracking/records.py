# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What is kept of the last frames, and how bodies moved over some of them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.images import Window
from gait_segmentation.scene.background import BackgroundModel
from gait_segmentation.scene.working import WorkingImage
from gait_segmentation.scene.world_motion import WorldMotion

__all__ = ['Record', 'Shift', 'body_over']

Shift = tuple[float, float]


@dataclass
class Record:
    """
    One frame, kept until its feedback came and as long as the cue from motion needs it.

    ``motion`` is how the world moved since the frame before.
    ``windows`` are the parts in which the background is known and learnt, disjoint.
    ``bodies`` has the shift of each body since the frame before, by track id; a track that is not
    in it did not exist.  ``notes`` has by track and cue a window and (h, w) uint8, what the cue
    will learn from when the mask comes.  ``heat`` is (h, w) uint8, P(person) as others see it, if
    they do, of ``heat_frames`` frames before; ``people`` is (h, w) uint8, non-zero where people
    were when the frame was learnt, None before.  ``outdated`` tells that more is known of the
    background by now, ``blank`` that nothing of the scene can be seen: something covers the lens,
    the picture is damaged, or it shows another place.
    """

    image: WorkingImage
    motion: WorldMotion
    background: BackgroundModel
    windows: list[Window]
    heat: NDArray[np.uint8] | None = None
    heat_frames: int = 0
    blank: bool = False
    outdated: bool = False
    people: NDArray[np.uint8] | None = None
    bodies: dict[int, Shift] = field(default_factory=dict)
    notes: dict[tuple[int, str], tuple[Window, NDArray[np.uint8]]] = field(default_factory=dict)

    def strange(self, window: Window, shadow_floor: float) -> NDArray[np.uint8]:
        """
        Return where a window does not look like the known background, (h, w) uint8 0/1.

        :param shadow_floor: darkest shadow, as a share of the lightness; shadows are background.
        """
        return self.background.contradicted(self.image.lab_part(window), window, shadow_floor)


def body_over(records: Iterable[Record], track_id: int) -> Shift:
    """Return how far a body went over several frames."""
    shifts = [each.bodies[track_id] for each in records if track_id in each.bodies]
    return sum(dx for dx, _ in shifts), sum(dy for _, dy in shifts)

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np

from gait_segmentation.scene.background import BackgroundModel
from gait_segmentation.scene.working import WorkingImage
from gait_segmentation.scene.world_motion import WorldMotion
from gait_segmentation.tracking.records import Record, body_over


def record(**bodies: tuple[float, float]) -> Record:
    image = WorkingImage.of(np.zeros((4, 6, 3), np.uint8), 1, (4, 6))
    made = Record(image, WorldMotion(), BackgroundModel((4, 6)), [])
    made.bodies = {int(name[1:]): shift for name, shift in bodies.items()}
    return made


def test_only_frames_count_that_a_body_was_in() -> None:
    frames = [record(_1=(1.0, 2.0)), record(_2=(9.0, 9.0)), record(_1=(0.5, 0))]
    assert body_over(frames, 1) == (1.5, 2.0)
    assert body_over(frames, 3) == (0, 0)

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.tracking.background.model import BackgroundModel
from gait_segmentation.tracking.picture.working import WorkingImage
from gait_segmentation.tracking.records import Record, body_over, camera_over


def record(camera: np.ndarray | None, **bodies: tuple[float, float]) -> Record:
    image = WorkingImage.of(np.zeros((4, 6, 3), np.uint8), 1, (4, 6))
    made = Record(image, camera, BackgroundModel((4, 6)), 0, [])
    made.bodies = {int(name[1:]): shift for name, shift in bodies.items()}
    return made


def test_motions_of_the_camera_are_made_one_after_the_other() -> None:
    turn, step = np.array([[0.0, -1, 0], [1, 0, 0]]), np.array([[1.0, 0, 2], [0, 1, 3]])
    still = record(None)
    assert camera_over([still, record(turn), still, record(step)]) @ [5, 1, 1] == pytest.approx(
        (1, 8)
    )
    assert camera_over([still, still]) @ [5, 1, 1] == pytest.approx((5, 1))
    assert camera_over([]) @ [5, 1, 1] == pytest.approx((5, 1))


def test_only_frames_count_that_a_body_was_in() -> None:
    frames = [record(None, _1=(1.0, 2.0)), record(None, _2=(9.0, 9.0)), record(None, _1=(0.5, 0))]
    assert body_over(frames, 1) == (1.5, 2.0)
    assert body_over(frames, 3) == (0, 0)

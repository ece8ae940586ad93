# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the recorder keeps of a frame."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='needs ROS 2: rclpy cannot be imported')

from gait_segmentation.cli.recorder import Record


def test_labels_are_kept_in_little_memory() -> None:
    labels = np.zeros((480, 640), np.uint8)
    labels[100:300, 200:260] = 1
    labels[120:330, 400:450] = 2
    record = Record()
    record.keep(labels[:, ::-1])
    assert record.packed is not None
    assert len(record.packed[0]) < 10_000
    assert (record.labels == labels[:, ::-1]).all()
    assert (record.mask == 255 * (labels[:, ::-1] > 0)).all()
    # A picture is drawn on it.
    record.labels[0, 0] = 1
    assert record.labels[0, 0] == 0

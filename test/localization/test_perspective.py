# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.geometry import Box
from gait_segmentation.localization import CameraPose, PinholeCamera
from test.localization.perspective import STATURE, WALL, Walk, film

CAMERA = PinholeCamera(640, 480, 525, 525, 319.5, 239.5)
POSE = CameraPose.above_ground(1.2)


def test_the_walker_stands_where_and_is_as_tall_and_as_far_as_said() -> None:
    (shot,) = film(Walk(lambda s: (5.0, 0.0, 1.5), 1.0, 1 / 30), CAMERA, POSE)
    np.testing.assert_allclose(shot.position, [0, 1.2, 5.0], atol=1e-9)
    assert shot.body.height == pytest.approx(525 * STATURE / 5)
    box = Box.around(shot.mask)
    assert box is not None
    # The foot in front is nearer than the body.
    assert box.y == pytest.approx(shot.body.center_y - shot.body.height / 2, abs=4)
    assert 0 < box.bottom - shot.body.center_y - shot.body.height / 2 < 12
    seen = shot.mask > 0
    assert np.all((shot.depth[seen] > 4.4) & (shot.depth[seen] < 5.5))
    assert shot.depth[0, 0] == pytest.approx(WALL)
    # The ground three metres ahead.
    row = round(239.5 + 525 * 1.2 / 3)
    assert shot.depth[row, 0] == pytest.approx(3.0, abs=0.01)

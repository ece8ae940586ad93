# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.gait_model.skeleton import Frame
from gait_segmentation.gait_model.solid import PARTS, BodyMaker, upright

PHASES = 3


@pytest.fixture
def frame():
    one = np.broadcast_to(np.eye(3), (PHASES, 3, 3))
    return Frame(along=one[:, 0], front=one[:, 1], left=one[:, 2])


def test_what_is_collected_is_handed_out(frame):
    maker = BodyMaker()
    members = [
        maker.ellipsoid(np.full((PHASES, 3), float(k)), frame, 0.1, 0.2, 0.3) for k in range(3)
    ]
    maker.chain('arms', members)
    maker.hull('head', members[0])
    body = maker.done()
    assert members == [0, 1, 2]
    assert body.pieces == ((0, 1), (1, 2), (0,))
    assert [PARTS[part] for part in body.parts] == ['arms', 'arms', 'head']
    assert body.centers[:, 2] == pytest.approx(np.full((PHASES, 3), 2.0))
    # Breadth goes to the left, depth to the front and length along.
    assert body.axes[0, 0] @ (1, 0, 0) == pytest.approx([0, 0, 0.1])
    assert body.axes[0, 0] @ (0, 1, 0) == pytest.approx([0, 0.2, 0])
    assert body.axes[0, 0] @ (0, 0, 1) == pytest.approx([0.3, 0, 0])


def test_upright(frame):
    head = upright(frame)
    assert head.along == pytest.approx(np.tile((0, 0, 1), (PHASES, 1)))
    assert head.front == pytest.approx(np.tile((1, 0, 0), (PHASES, 1)))
    assert head.left == pytest.approx(np.tile((0, 1, 0), (PHASES, 1)))

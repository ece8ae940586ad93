# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import math

import numpy as np
import pytest

from gait_segmentation.gait_model import TemplateBank
from gait_segmentation.matching.views import Views

AZIMUTHS = np.array([0, 40, 80, 180, 0, 170], np.float32)


def views():
    builds = ('a', 'a', 'a', 'a', 'b', 'b')
    templates = np.zeros((6, 2, 4, 4), np.uint8)
    return Views(TemplateBank(templates, np.deg2rad(AZIMUTHS), builds, 0.9))


def test_neighbours_are_of_the_same_build_all_the_way_round():
    ring = views()
    assert ring.beside(1) == (0, 2)
    assert ring.beside(0) == (3, 1)
    assert ring.beside(3) == (2, 0)
    assert ring.beside(4) == (5, 5)


def test_directions_between_views():
    ring = views()
    assert ring.azimuth(1, -0.5) == pytest.approx(math.radians(20))
    assert ring.azimuth(1, 0.5) == pytest.approx(math.radians(60))
    # There is nothing between views that are far apart.
    assert ring.azimuth(2, 0.5) == pytest.approx(math.radians(80))

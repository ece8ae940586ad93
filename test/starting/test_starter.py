# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from gait_segmentation.detector.lookout import Lookout
from gait_segmentation.detector.networks import Networks
from gait_segmentation.geometry import Box
from gait_segmentation.heat_maps import HeatMap
from gait_segmentation.scene.scene import Scene
from gait_segmentation.starting import StartingConfig
from gait_segmentation.starting.starter import Known, Starter
from test.tracking.figures import HEIGHT, WIDTH, Figure
from test.walkers import small_bank

LEAVING = Box(-30, 20, 50, 140)


@pytest.mark.parametrize(
    ('somebody', 'found'),
    [
        (Known(), True),
        (Known(lost=(LEAVING,)), False),
        (Known(tracked=(LEAVING,)), False),
        (Known(lost=(LEAVING.shifted(40, 0),)), True),
        (Known(lost=(LEAVING.shifted(-60, 0),)), True),
        (Known(lost=(Box(-30, 40, 50, 90),)), True),
    ],
)
def test_nobody_begins_with_what_is_left_of_somebody_who_leaves(somebody, found):
    starter = Starter(
        small_bank(), StartingConfig(), 2, Lookout(networks=Networks(lambda image: []))
    )
    scene = Scene((HEIGHT, WIDTH))
    scene.advance(np.zeros((HEIGHT, WIDTH, 3), np.uint8), 1)
    heat = HeatMap(Figure(34, height=80).mask(), 1, 1.0)
    assert bool(starter.propose(scene, heat, None, somebody)) == found

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.geometry import Box
from gait_segmentation.starting.first_scene import FirstScene, first_scene

BOX = Box(20, 10, 40, 100)


def scene() -> FirstScene:
    """Return a window with somebody dark in the left half of the box, before something light."""
    lab = np.full((120, 80, 3), 200, np.uint8)
    lab[10:110, 20:40] = 60
    return first_scene(lab, BOX, None)


def test_colours_decide_by_what_they_were_learnt_from() -> None:
    found = scene()
    person = np.zeros(found.shape, np.float32)
    person[30:90, 25:35] = 1
    logit = found.logit(person, 1 - person, 0.3)
    assert logit[50, 22] > 0 > logit[50, 50]
    assert np.abs(logit).max() <= 4
    swapped = found.logit(1 - person, person, 0.3)
    assert swapped == pytest.approx(-logit), 'what was learnt before is forgotten'


def test_a_mask_that_touches_all_sides_of_the_box_has_no_gap() -> None:
    found = scene()
    labels = np.zeros(found.shape, np.bool_)
    assert found.gap(labels) == 1
    labels[11:110, 20:59] = True
    assert found.gap(labels) == 0, 'within what a given box may be off'
    labels[:, 40:] = False
    assert found.gap(labels) == pytest.approx(0.5 - 0.03)
    labels[:60] = False
    assert found.gap(labels) == pytest.approx(1 - 2 * 0.03)

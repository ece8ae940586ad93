# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import itertools

import numpy as np
import pytest

from gait_segmentation.gait_model import TemplateBank
from gait_segmentation.matching.scores import Scores
from gait_segmentation.matching.search_range import SearchRange
from gait_segmentation.matching.subgrid import SubgridPeak
from gait_segmentation.matching.tanimoto import pitch_of
from gait_segmentation.matching.views import Views

VIEWS, PHASES, SHAPE = 8, 6, (3, 5, 4)
LANES = pitch_of(60)
ALL = SearchRange((0, 0, 0), SHAPE)


def peak():
    azimuth = np.arange(VIEWS, dtype=np.float32) * np.float32(np.pi / 4)
    templates = np.zeros((VIEWS, PHASES, 4, 4), np.uint8)
    return SubgridPeak(Views(TemplateBank(templates, azimuth, ('a',) * VIEWS, 0.9)), PHASES)


def scores(best):
    """Return a paraboloid about a place; view and phase go round."""
    result = np.zeros((VIEWS, PHASES, LANES), np.int16)
    for place in itertools.product(range(VIEWS), range(PHASES), *(range(n) for n in SHAPE)):
        off = np.array(place) - best
        off[0] = (off[0] + VIEWS / 2) % VIEWS - VIEWS / 2
        off[1] = (off[1] + PHASES / 2) % PHASES - PHASES / 2
        result[place[0], place[1], ALL.lane(*place[2:])] = round(
            5000 - 200 * float((off**2).sum())
        )
    return result


def kept(values, searched=ALL):
    return Scores(values.reshape(VIEWS, -1), np.arange(VIEWS, dtype=np.int32), searched)


def test_finds_the_vertex_along_each_axis():
    best = np.array([0.25, -0.375, 1.25, 2.5, 1.75])
    found = peak().offsets(kept(scores(best)), (0, 0, 1, 2, 2))
    assert found == pytest.approx([0.25, -0.375, 0.25, 0.5, -0.25], abs=0.01)


def test_the_border_and_flat_scores_have_no_vertex():
    values = scores(np.array([0.25, 0.25, 0.25, 0.25, 0.25]))
    assert peak().offsets(kept(values), (0, 0, 0, 0, 0))[2:] == [0.0, 0.0, 0.0]
    assert peak().offsets(kept(np.zeros_like(values)), (0, 0, 1, 1, 1)) == [0.0] * 5


def test_there_is_no_vertex_beside_what_was_not_searched():
    values = scores(np.array([0.0, 0.0, 1.25, 2.5, 1.75]))
    some = SearchRange((0, 0, 0), (2, *SHAPE[1:]))
    found = peak().offsets(kept(values, some), (0, 0, 1, 2, 2))
    assert found == pytest.approx([0.0, 0.0, 0.0, 0.5, -0.25], abs=0.01)
    where = np.arange(VIEWS, dtype=np.int32)
    where[1] = -1
    values = scores(np.array([0.25, 0.0, 1.25, 2.5, 1.75]))
    assert peak().offset(kept(values), (0, 0, 1, 2, 2), 0) == pytest.approx(0.25, abs=0.01)
    found = Scores(values.reshape(VIEWS, -1), where, ALL)
    assert peak().offset(found, (0, 0, 1, 2, 2), 0) == 0.0

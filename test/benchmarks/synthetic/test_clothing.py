# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np

from benchmarks.synthetic.clothing import make_outfit, paint
from gait_tools.gait_model import PARTS, render_parts


def test_legs_are_bare_under_a_dress():
    dress = make_outfit(np.random.default_rng(0), 'dress')
    assert dress.colours['legs'] is dress.colours['hands']
    assert 'legs' not in dress.textures


def test_parts_get_their_colours():
    parts = render_parts(0.1, 0.0, 100)
    outfit = make_outfit(np.random.default_rng(1))
    picture = paint(parts, outfit)
    assert picture.shape == (*parts['torso'].shape, 3)
    assert picture.min() >= 0
    assert picture.max() <= 255
    for name in ('torso', 'legs'):
        found = picture[parts[name] == 255].mean(axis=0)
        np.testing.assert_allclose(found, outfit.colours[name], atol=25)


def test_hair_is_on_top_of_the_head():
    head = np.zeros((40, 20), np.uint8)
    head[10:30, 5:15] = 255
    parts = {name: head if name == 'head' else np.zeros_like(head) for name in PARTS}
    outfit = make_outfit(np.random.default_rng(2))
    picture = paint(parts, outfit)
    np.testing.assert_allclose(picture[13, 10], outfit.hair, atol=30)
    np.testing.assert_allclose(picture[26, 10], outfit.colours['head'], atol=30)


def test_the_hem_hides_the_legs():
    parts = render_parts(0.0, 0.0, 120, build='dress')
    rows = np.flatnonzero((parts['skirt'] > 127).any(axis=1))
    outfit = make_outfit(np.random.default_rng(3), 'dress')
    row = (rows[0] + rows[-1]) // 2
    found = paint(parts, outfit)[row][parts['legs'][row] > 250]
    assert len(found) > 0
    np.testing.assert_allclose(found.mean(axis=0), outfit.colours['skirt'], atol=40)

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import itertools

import numpy as np
import pytest

from benchmarks.synthetic.things import THINGS, ThingClip


@pytest.mark.parametrize('name', THINGS)
def test_a_thing_moves_and_is_no_larger_than_the_picture(name: str) -> None:
    (first, _), *_, (last, stamp_ns) = itertools.islice(ThingClip(name), 20)
    changed = np.abs(first.astype(int) - last).max(axis=2) > 25
    assert 0.001 < changed.mean() < 0.8
    assert first.shape == (240, 320, 3)
    assert stamp_ns > 0


def test_the_same_seed_gives_the_same_bits() -> None:
    one, same, other = (
        next(itertools.islice(ThingClip('dog', seed), 15, None))[0] for seed in (1, 1, 2)
    )
    assert np.array_equal(one, same)
    assert not np.array_equal(one, other)


def test_in_odd_seeds_it_first_stands_still() -> None:
    images = [image for image, _ in itertools.islice(ThingClip('box', 1), 4)]
    assert np.abs(images[0].astype(int) - images[3]).mean() < 5

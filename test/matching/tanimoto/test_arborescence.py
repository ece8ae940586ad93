# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import itertools

import numpy as np

from gait_segmentation.matching.tanimoto.arborescence import minimum_arborescence


def weight(pixels, parents):
    empty = np.zeros_like(pixels[0])
    return sum(
        int((row != (pixels[p] if p >= 0 else empty)).sum())
        for row, p in zip(pixels, parents, strict=True)
    )


def reaches_root(parents):
    for start in range(len(parents)):
        seen, node = set(), start
        while node >= 0:
            if node in seen:
                return False
            seen.add(node)
            node = parents[node]
    return True


def test_is_the_lightest_of_all_trees():
    rng = np.random.default_rng(3)
    for _ in range(5):
        pixels = rng.integers(0, 3, (4, 9)).astype(np.uint8)
        order, parents = minimum_arborescence(pixels)
        trees = itertools.product(range(-1, 4), repeat=4)
        best = min(weight(pixels, tree) for tree in trees if reaches_root(tree))
        assert weight(pixels, parents) == best
        place = {int(k): n for n, k in enumerate(order)}
        assert all(p < 0 or place[int(p)] < place[k] for k, p in enumerate(parents))

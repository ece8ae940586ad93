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


def test_templates_of_many_pixels_become_the_lightest_tree_too():
    rng = np.random.default_rng(4)
    pixels = np.zeros((12, 2000), np.uint8)
    for k in range(1, 12):
        pixels[k] = pixels[k - 1]
        changed = rng.integers(0, 2000, 150 * (1 + k % 4))
        pixels[k, changed] = rng.integers(0, 4, len(changed))
    shuffled = pixels[rng.permutation(12)]
    # Kruskal's way: the lightest edges that close no ring.
    nodes = np.vstack([np.zeros(2000, np.uint8), shuffled])
    edges = sorted(
        (int((nodes[a] != nodes[b]).sum()), a, b) for a, b in itertools.combinations(range(13), 2)
    )
    tree, lightest = list(range(13)), 0
    for length, a, b in edges:
        if tree[a] != tree[b]:
            lightest += length
            tree = [tree[a] if each == tree[b] else each for each in tree]
    _, parents = minimum_arborescence(shuffled)
    assert reaches_root(parents)
    assert weight(shuffled, parents) == lightest

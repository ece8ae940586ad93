# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Common areas by the definition, and banks and images that kernels must treat alike."""

import numpy as np
from hypothesis import strategies as st

from gait_segmentation.matching.common_areas import CommonAreas
from gait_segmentation.matching.placements import SearchRange, WindowGrid


def windows_of(images, grid):
    """Return all windows, (S, rows, columns, height, width)."""
    view = np.lib.stride_tricks.sliding_window_view(images, (grid.height, grid.width), (1, 2))
    return view[:, :: grid.step, :: grid.step]


def definition(templates, images, grid):
    """Return C = sum of min(likelihood, template), (K, S, rows, columns)."""
    windows = windows_of(images, grid)
    return np.stack(
        [np.minimum(each, windows).sum(axis=(3, 4), dtype=np.int32) for each in templates]
    )


def common_area(kernel: CommonAreas, images, grid):
    """Return the same by a kernel."""
    searched = SearchRange((0, 0, 0), (len(images), grid.rows, grid.columns))
    memory = kernel.new_matrix(), kernel.new_rows(searched.pitch)
    found = kernel.common_rows(images, searched, *memory)[kernel.row, : searched.size]
    return found.reshape(-1, *searched.shape)


@st.composite
def banks(draw):
    """Draw templates (ties, all black, all white, duplicates, few levels), images and a grid."""
    height, width = draw(st.integers(1, 9)), draw(st.integers(1, 9))
    grid = WindowGrid(
        height, width, draw(st.integers(1, 13)), draw(st.integers(1, 20)), draw(st.integers(1, 3))
    )
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    count = draw(st.integers(1, 6))
    kind = draw(st.sampled_from(['any', 'binary', 'levels', 'black', 'white', 'same']))
    templates = rng.integers(0, 256, (count, height, width), dtype=np.uint8)
    if kind == 'binary':
        templates = np.where(templates > 127, 255, 0).astype(np.uint8)
    elif kind == 'levels':
        templates = (templates // 37 * 36).astype(np.uint8)
    elif kind == 'black':
        templates[:] = 0
    elif kind == 'white':
        templates[:] = 255
    elif kind == 'same':
        templates[:] = templates[0]
    images = rng.integers(0, 256, (draw(st.integers(1, 3)), *grid.image_shape), dtype=np.uint8)
    look = draw(st.sampled_from(['any', 'black', 'white', 'ties']))
    if look in ('black', 'white'):
        images[:] = 0 if look == 'black' else 255
    elif look == 'ties':
        images = templates.ravel()[rng.integers(0, templates.size, images.shape)]
    return templates, images, grid

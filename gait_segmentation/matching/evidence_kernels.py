# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Passes over the pixels of templates and likelihood that the evidence is made of, compiled."""

from __future__ import annotations

import numpy as np

from gait_segmentation.kernels import kernel

__all__ = ['compare', 'pair']

_ALL = 255


@kernel(
    'f4[:,:,::1], f4[:,::1], f4[:,:,:,:,::1], f4[:,:,:,:,::1], b1, UniTuple(f8, 2), '
    'UniTuple(i8, 3), b1[:,:,::1], f8[::1], f8[:,:,:,::1]',
    fastmath=True,
)
def compare(  # type: ignore[no-untyped-def]
    templates, squares, values, seen, all_seen, levels, part, wanted, weights, result
):
    """
    Put minus half the least sum of squared differences of each template into ``result``.

    Not by matrix products: those of BLAS wait for each other's threads where cores are busy.

    :param templates: (V, P, n) float32, and ``squares`` (V, P) the sums of their squares.
    :param values: (S, 2, 2, h + 2, w + 2) float32, see :func:`pair`; ``seen`` likewise.
    :param levels: values that mean 1 and 0.
    :param part: first row, first column and width of the part that the templates have.
    """
    views, phases, count = templates.shape
    top, left, width = part
    ground, scale = np.float32(levels[1]), np.float32(1.0 / (levels[0] - levels[1]))
    scaled = np.empty(values.size, np.float32)
    flat, known = values.reshape(-1), seen.reshape(-1)
    for j in range(len(scaled)):
        scaled[j] = (flat[j] - ground * known[j]) * scale
    scaled = scaled.reshape(values.shape)
    # One for each column; the best one counts.
    lines = np.empty((3, count), np.float32)
    shown = np.empty((3, count), np.float32)
    for tall in range(values.shape[0]):
        for down in range(3):
            if not wanted[:, tall, down].any():
                continue
            for across in range(3):
                odd = (down + 1) % 2, (across + 1) % 2
                above, before = top + (down + 1) // 2, left + (across + 1) // 2
                _cut(scaled[tall, odd[0], odd[1]], above, before, width, lines[across])
                if not all_seen:
                    visible = seen[tall, odd[0], odd[1]]
                    _cut(visible, above, before, width, shown[across])
            for view in range(views):
                if not wanted[view, tall, down]:
                    continue
                for phase in range(phases):
                    own = templates[view, phase]
                    first, second, third = _alike(own, lines)
                    half = np.float32(0.5) * squares[view, phase]
                    best = max(first, second, third) - half
                    if not all_seen:
                        one, two, three = _squared(own, shown)
                        best = max(
                            first - np.float32(0.5) * one,
                            second - np.float32(0.5) * two,
                            third - np.float32(0.5) * three,
                        )
                    result[view, tall, down, phase] = weights[tall] * best


@kernel()
def _cut(image, top, left, width, line):  # type: ignore[no-untyped-def]
    """Put the rows of a part of an image one after the other into a line."""
    for row in range(len(line) // width):
        source, target = image[top + row], line[row * width :]
        for column in range(width):
            target[column] = source[left + column]


@kernel(fastmath=True)
def _alike(template, lines):  # type: ignore[no-untyped-def]
    """Return the products of a template with three lines."""
    first, second, third = np.float32(0), np.float32(0), np.float32(0)
    for j in range(len(template)):
        first += template[j] * lines[0, j]
        second += template[j] * lines[1, j]
        third += template[j] * lines[2, j]
    return first, second, third


@kernel(fastmath=True)
def _squared(template, lines):  # type: ignore[no-untyped-def]
    """Return the products of a template's squares with three lines."""
    first, second, third = np.float32(0), np.float32(0), np.float32(0)
    for j in range(len(template)):
        square = template[j] * template[j]
        first += square * lines[0, j]
        second += square * lines[1, j]
        third += square * lines[2, j]
    return first, second, third


@kernel('u1[:,:,::1], u1[:,:,::1], f4[:,:,:,:,::1], f4[:,:,:,:,::1]', fastmath=True)
def pair(images, masks, values, seen):  # type: ignore[no-untyped-def]
    """
    Put the means of 2 x 2 known pixels into ``values`` and what is known into ``seen``, in 0..1.

    :param images: (S, h, w) uint8, h and w even, and ``masks`` likewise, 0 where unknown.
    :param values: (S, 2, 2, h / 2, w / 2) float32, and ``seen`` likewise: the means from even and
        from odd rows on, of each from even and from odd columns on.  What would begin in the
        last row or column is left as it is.
    """
    count, height, width = images.shape
    quarter = np.float32(0.25)
    share = quarter / np.float32(_ALL)
    total, known = np.zeros(width + 1, np.float32), np.zeros(width + 1, np.float32)
    for k in range(count):
        for y in range(height - 1):
            image, below = images[k, y], images[k, y + 1]
            mask, mask_below = masks[k, y], masks[k, y + 1]
            for x in range(width):
                # Masks are 0 or 255, all bits.
                both = np.int32(image[x] & mask[x]) + np.int32(below[x] & mask_below[x])
                total[x] = share * np.float32(both)
                known[x] = share * np.float32(np.int32(mask[x]) + np.int32(mask_below[x]))
            for odd in range(2):
                value, visible = values[k, y % 2, odd, y // 2], seen[k, y % 2, odd, y // 2]
                for x in range(width // 2 - odd):
                    value[x] = total[2 * x + odd] + total[2 * x + odd + 1]
                    visible[x] = known[2 * x + odd] + known[2 * x + odd + 1]

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The shape of a body: how much a region has of it."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.images import tanimoto

_SHAPE_ROWS = 24  # height in pixels at which regions are compared with templates


class BodyShapes:
    """Templates of a bank, every other phase and view, tight about the body and small."""

    def __init__(self, bank: TemplateBank) -> None:
        rows = bank.templates.shape[2]
        top, bottom = round(rows * (1 - bank.fill) / 2), round(rows * (1 + bank.fill) / 2)
        chosen = bank.templates[::2, ::2].reshape(-1, *bank.templates.shape[2:])
        # A template is never wider than twice its height.
        shapes = [normalised(template[top:bottom]) for template in chosen]
        self._shapes = np.stack([shape for shape in shapes if shape is not None])

    def likeness(self, shape: NDArray[np.uint8] | None) -> float:
        """Return the similarity of a normalised shape with the template most like it, 0 to 1."""
        return 0.0 if shape is None else float(tanimoto(self._shapes, shape).max())


def normalised(region: NDArray[np.uint8], aspect: float | None = None) -> NDArray[np.uint8] | None:
    """
    Return a tight region at a size of 24 x 48, its centre of mass in the middle.

    :param region: (h, w) uint8, 255 inside.
    :param aspect: its width over its height, if its pixels are not square.
    :returns: (24, 48) uint8, None of what is wider than that.
    """
    height, width = region.shape
    columns = max(1, round(_SHAPE_ROWS * (width / height if aspect is None else aspect)))
    if columns > 2 * _SHAPE_ROWS:
        return None
    small = np.asarray(cv2.resize(region, (columns, _SHAPE_ROWS), interpolation=cv2.INTER_AREA))
    mass = small.sum(axis=0, dtype=np.float64)
    middle = int(np.rint((mass @ np.arange(columns)) / max(mass.sum(), 1.0)))
    out = np.zeros((_SHAPE_ROWS, 2 * _SHAPE_ROWS), np.uint8)
    left = _SHAPE_ROWS - middle
    first, last = max(left, 0), min(left + columns, 2 * _SHAPE_ROWS)
    out[:, first:last] = small[:, first - left : last - left]
    return out

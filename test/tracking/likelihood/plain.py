# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A person on plain ground in Lab, some of which may lie in a shadow."""

from __future__ import annotations

import numpy as np

from gait_segmentation.colour import ColourModel, colour_bins
from gait_segmentation.geometry import BodyFrame
from gait_segmentation.images import Window
from gait_segmentation.scene.background import BackgroundModel

SHAPE = (130, 160)
ALL = (slice(0, 130), slice(0, 160))
PERSON = BodyFrame(80.0, 60.0, 100.0)
BODY = (slice(10, 110), slice(70, 90))

Lab = tuple[int, int, int]


def body() -> np.ndarray:
    mask = np.zeros(SHAPE, np.uint8)
    mask[BODY] = 255
    return mask


def plain(ground: Lab, shirt: Lab, shade: Lab | None, where: Window) -> np.ndarray:
    """Return the picture of a person; what is to be in the shadow lies behind."""
    lab = np.empty((*SHAPE, 3), np.uint8)
    lab[:] = ground
    if shade is not None:
        lab[where] = shade
    lab[BODY] = shirt
    return lab


def background_of(ground: Lab, times: float = 5.0) -> BackgroundModel:
    """Return a background that was seen without a shadow, a number of times."""
    model = BackgroundModel(SHAPE)
    model.sums[:] = times * np.array([*ground, 1], np.float32)
    return model


def looks(lab: np.ndarray) -> tuple[np.ndarray, np.ndarray, ColourModel]:
    """Return bins and rows of all pixels, and the colours of a person who has all of them."""
    colours = ColourModel(0.7, 1e-4)
    colours.table[:] = 0.05
    return colour_bins(lab), np.full(SHAPE, 0.5, np.float32), colours

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
What a first mask is estimated from: the window about a box, and what is known of it.

A pixel inside the box may be connected with what is outside of it: the minimum barrier distance
(Strand, Ciesielski, Malmberg and Saha, CVIU 2013; by raster scans as in Zhang et al., ICCV 2015)
from the outside is the least range of colours on any path there.  Walls, floor and pillars that
run on into the box are near, a person is not.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.colour import BANDS, ColourModel, body_rows, colour_bins
from gait_segmentation.geometry import Box
from gait_segmentation.kernels import kernel
from gait_segmentation.segmentation.graph_cut import (
    contrast_links,
    decided,
    mean_contrast,
    minimum_cut,
    open_graph,
)

_FLOOR = 3e-5
_LIMIT = 4.0
"""Probability of a colour never seen, and most that colours say, as a logarithm."""

_SCANS = 6
_FAR = np.float32(1e9)
_LEVEL, _TEXTURE_GAIN = 15.0, 0.7
"""Barrier that says nothing: a constant and a share of the texture's range of colours."""

_SLOPE, _BARRIER_LIMIT = 0.5, 2.0
_BARRIER_WEIGHT = 0.5
_CONTRAST = 2.0
_LOOSE = 0.03
"""How far within a side a mask may end as if it touched it: given boxes are not tight."""

_ROOM = 0.06
"""How far beyond the box there may be something of the person that stands out, in heights."""


@dataclass(frozen=True)
class FirstScene:
    """
    The window about the box at the size the start is estimated on.

    ``lab`` is (h, w, 3) uint8 and ``bins`` (h, w) its colour bins, ``rows`` (h, w) float32 how
    far down the body, ``inside`` (h, w) bool where the person may be, ``evidence`` (h, w) float32
    are log-odds of the person that do not change, and ``height`` is the box's.  ``models`` are
    learnt anew for each soft mask: one of the person, one of the surroundings.
    """

    lab: NDArray[np.uint8]
    bins: NDArray[np.uint16]
    rows: NDArray[np.float32]
    inside: NDArray[np.bool_]
    evidence: NDArray[np.float32]
    contrast: float
    height: float
    models: tuple[ColourModel, ColourModel]

    @property
    def shape(self) -> tuple[int, int]:
        """Return (h, w) of the window."""
        return self.inside.shape[0], self.inside.shape[1]

    def turned(self, box: Box, angle: float) -> FirstScene:
        """Return the same scene with the height bands of a leaning body."""
        rows = body_rows(self.shape, (0, 0), (box.center_x, box.center_y), box.height, angle)
        return replace(self, rows=rows)

    def logit(
        self, person: NDArray[np.float32], rest: NDArray[np.float32], band_share: float
    ) -> NDArray[np.float32]:
        """
        Return ln p(person) / p(surroundings) of all pixels by their colours, within +-4.

        :param person: (h, w) float32 in 0..1, the soft mask that colours are learnt from; ``rest``
            likewise of the surroundings.
        :param band_share: weight of the colours of the own height band.
        """
        bands = np.clip((self.rows * np.float32(BANDS)).astype(np.intp), 0, BANDS - 1)
        found = []
        for model, weight in zip(self.models, (person, rest), strict=True):
            model.band_share = band_share
            model.learn(self.bins, self.rows, weight, 1.0)
            found.append(np.log(model.table[self.bins, bands]))
        return np.clip(found[0] - found[1], -_LIMIT, _LIMIT)

    def cut(self, logit: NDArray[np.float32]) -> NDArray[np.bool_]:
        """Return the cut of least energy with a data term, (h, w) float32."""
        graph = open_graph(np.where(self.inside, decided(logit), np.int8(-1)))
        contrast_links(graph, self.lab, _CONTRAST, self.contrast)
        return minimum_cut(graph, logit.reshape(-1)[graph.pixels])

    def gap(self, labels: NDArray[np.bool_]) -> float:
        """
        Return by how much a mask falls short of the sides of where the person may be.

        :param labels: (h, w) bool.
        :returns: sum over the four sides, as shares of the width and height; 1 for no mask.
        """
        if not labels.any():
            return 1.0
        gap = 0.0
        for axis in (0, 1):
            whole = np.flatnonzero(self.inside.any(axis))
            found = np.flatnonzero(labels.any(axis))
            for short in (found[0] - whole[0], whole[-1] - found[-1]):
                gap += max(float(short) / len(whole) - _LOOSE, 0.0)
        return gap


def first_scene(lab: NDArray[np.uint8], box: Box, known: NDArray[np.float32] | None) -> FirstScene:
    """
    Prepare a window.

    :param lab: (h, w, 3) uint8.
    :param box: tight box of the person in its pixels.
    :param known: (h, w) float32, log-likelihood ratios of the person from elsewhere, 0 where
        nothing is known; None if it is nowhere.
    """
    shape = lab.shape[:2]
    inside = np.zeros(shape, np.bool_)
    inside[box.slices(shape[1], shape[0])] = True
    evidence = np.float32(_BARRIER_WEIGHT) * barrier_logit(lab, inside)
    if known is not None:
        # Where it is known what is there the box need not be exact.
        room = box.padded(_ROOM * box.height, _ROOM * box.height).slices(shape[1], shape[0])
        inside[room] |= known[room] > 0
        evidence += known * inside
    rows = body_rows(shape, (0, 0), (box.center_x, box.center_y), box.height)
    contrast = mean_contrast(open_graph(np.where(inside, 0, -1).astype(np.int8)), lab)
    models = ColourModel(1.0, _FLOOR), ColourModel(1.0, _FLOOR)
    bins = colour_bins(lab)
    return FirstScene(lab, bins, rows, inside, evidence, contrast, box.height, models)


@kernel('u1[:,:,::1], f4[:,::1], u1[:,:,::1], u1[:,:,::1], b1')
def _scan(
    image: NDArray[np.uint8],
    distance: NDArray[np.float32],
    high: NDArray[np.uint8],
    low: NDArray[np.uint8],
    forward: bool,
) -> None:
    height, width = distance.shape
    step = -1 if forward else 1
    for i in range(height):
        row = i if forward else height - 1 - i
        for j in range(width):
            col = j if forward else width - 1 - j
            if distance[row, col] == 0:
                continue
            for side in range(2):
                from_row = row + step if side == 0 else row
                from_col = col if side == 0 else col + step
                if not (0 <= from_row < height and 0 <= from_col < width):
                    continue
                if distance[from_row, from_col] >= _FAR:
                    continue
                barrier = 0
                for channel in range(3):
                    value = image[row, col, channel]
                    top = max(high[from_row, from_col, channel], value)
                    bottom = min(low[from_row, from_col, channel], value)
                    barrier += top - bottom
                if barrier < distance[row, col]:
                    distance[row, col] = barrier
                    for channel in range(3):
                        value = image[row, col, channel]
                        high[row, col, channel] = max(high[from_row, from_col, channel], value)
                        low[row, col, channel] = min(low[from_row, from_col, channel], value)


def barrier_distance(image: NDArray[np.uint8], inside: NDArray[np.bool_]) -> NDArray[np.float32]:
    """
    Return the minimum barrier distance of each pixel from the outside of a region.

    :param image: (h, w, 3) uint8.
    :param inside: (h, w) bool, the region; all other pixels have distance zero.
    :returns: (h, w) float32, in grey levels summed over the channels; 1e9 where the region has
        no outside.
    """
    distance = np.where(inside, _FAR, np.float32(0)).astype(np.float32)
    high, low = image.copy(), image.copy()
    for number in range(_SCANS):
        _scan(image, distance, high, low, number % 2 == 0)
    return distance


def barrier_logit(lab: NDArray[np.uint8], inside: NDArray[np.bool_]) -> NDArray[np.float32]:
    """
    Return evidence for the person from the barrier distance, zero outside of the region.

    What distance is large depends on the texture of the surroundings, and is measured there.

    :param lab: (h, w, 3) uint8.
    :param inside: (h, w) bool, the box.
    :returns: (h, w) float32, limited to +-2.
    """
    if inside.all() or not inside.any():
        return np.zeros(inside.shape, np.float32)
    smooth = cv2.GaussianBlur(lab, (3, 3), 0)
    kernel = np.ones((5, 5), np.uint8)
    spread = cv2.absdiff(cv2.dilate(smooth, kernel), cv2.erode(smooth, kernel))
    texture = float(np.median(spread[~inside].sum(axis=1, dtype=np.int32)))
    neutral = _LEVEL + _TEXTURE_GAIN * texture
    logit = (barrier_distance(smooth, inside) - neutral) / (_SLOPE * neutral)
    return (np.clip(logit, -_BARRIER_LIMIT, _BARRIER_LIMIT) * inside).astype(np.float32)

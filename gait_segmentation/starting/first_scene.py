# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a first mask is estimated from: the window about a box, and what is known of it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.colour import body_rows, colour_bins
from gait_segmentation.geometry import Box
from gait_segmentation.segmentation.energy import contrast_links, mean_contrast
from gait_segmentation.segmentation.graph_cut import decided, minimum_cut, open_graph
from gait_segmentation.starting.barrier import barrier_logit
from gait_segmentation.starting.colours import SoftColours

__all__ = ['FirstScene', 'first_scene']

_FLOOR = 3e-5
_NEAR = 0.05
_BARRIER_WEIGHT = 0.5
_CONTRAST = 2.0
_ROOM = 0.06
"""How far beyond the box there may be something of the person that stands out, in heights."""

_CHROMA_GAIN = 2.0
"""Steepness of a and b over that of L as an edge."""

_EDGE_LEVEL, _EDGE_SHARE = 8.0, 0.5
"""Steepness that is half an edge: Sobel's response, and a share of its median in the box."""


@dataclass(frozen=True)
class FirstScene:
    """
    The window about the box at the size the start is estimated on.

    ``lab`` is (h, w, 3) uint8, ``inside`` (h, w) bool, where the person may be, ``colours`` are
    learnt anew for each hypothesis, ``evidence`` (h, w) float32 are log-odds of the person that
    do not change, and ``height`` is the box's.  ``edges`` (2, h, w) float32 is the direction
    across edges, x and y, as long as they are sure (0..1).
    """

    lab: NDArray[np.uint8]
    inside: NDArray[np.bool_]
    colours: SoftColours
    evidence: NDArray[np.float32]
    edges: NDArray[np.float32]
    contrast: float
    height: float

    @property
    def shape(self) -> tuple[int, int]:
        """Return (h, w) of the window."""
        return self.inside.shape[0], self.inside.shape[1]

    def turned(self, box: Box, angle: float) -> FirstScene:
        """Return the same scene with the height bands of a leaning body."""
        rows = body_rows(self.shape, (0, 0), (box.center_x, box.center_y), box.height, angle)
        return replace(self, colours=self.colours.with_rows(rows))

    def cut(self, logit: NDArray[np.float32]) -> NDArray[np.bool_]:
        """Return the cut of least energy with a data term, (h, w) float32."""
        graph = open_graph(np.where(self.inside, decided(logit), np.int8(-1)))
        contrast_links(graph, self.lab, _CONTRAST, self.contrast)
        return minimum_cut(graph, logit.reshape(-1)[graph.pixels])


def first_scene(
    lab: NDArray[np.uint8], box: Box, left_out: float, known: NDArray[np.float32] | None
) -> FirstScene:
    """
    Prepare a window.

    :param lab: (h, w, 3) uint8.
    :param box: tight box of the person in its pixels.
    :param left_out: share of what was learnt near a pixel that is taken off to judge it.
    :param known: (h, w) float32, log-likelihood ratios of the person from elsewhere, 0 where
        nothing is known; None if it is nowhere.
    """
    shape = lab.shape[:2]
    inside = np.zeros(shape, np.bool_)
    inside[box.slices(shape[1], shape[0])] = True
    if known is not None:
        # Where it is known what is there the box need not be exact.
        room = box.padded(_ROOM * box.height, _ROOM * box.height).slices(shape[1], shape[0])
        inside[room] |= known[room] > 0
    smooth = cv2.GaussianBlur(lab, (3, 3), 0).astype(np.float32)
    across, down = (
        np.asarray(cv2.Sobel(smooth, cv2.CV_32F, *order, ksize=3), np.float32)
        for order in ((1, 0), (0, 1))
    )
    evidence = np.float32(_BARRIER_WEIGHT) * barrier_logit(lab, inside)
    if known is not None:
        evidence += known * inside
    colours = SoftColours(
        colour_bins(lab),
        body_rows(shape, (0, 0), (box.center_x, box.center_y), box.height),
        inside,
        floor=_FLOOR,
        radius=max(1, round(_NEAR * box.height)),
        left_out=left_out,
    )
    contrast = mean_contrast(open_graph(np.where(inside, 0, -1).astype(np.int8)), lab)
    edges = _edges(across, down, inside)
    return FirstScene(lab, inside, colours, evidence, edges, contrast, box.height)


def _edges(
    across: NDArray[np.float32], down: NDArray[np.float32], inside: NDArray[np.bool_]
) -> NDArray[np.float32]:
    """
    Return the direction across edges, (2, h, w) float32, as long as they are sure (0..1).

    :param across, down: (h, w, 3) float32, the steepness of the channels.
    :param inside: (h, w) bool, where edges are usual.
    """
    gain = np.array([1, _CHROMA_GAIN, _CHROMA_GAIN], np.float32)
    across, down = across * gain, down * gain
    strongest = (across**2 + down**2).argmax(axis=2)[..., None]
    both = np.stack([np.take_along_axis(each, strongest, 2)[..., 0] for each in (across, down)])
    steep = np.sqrt((both**2).sum(axis=0))
    usual = float(np.median(steep[inside])) if inside.any() else 0.0
    return both / (steep + np.float32(_EDGE_LEVEL + _EDGE_SHARE * usual))

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The first mask from a box alone: a joint estimate over views, colours and the cut.

For each direction of walking, expectation maximisation alternates between the colours of person
and surroundings, the weights of the templates laid onto the box, and a graph cut.  Where a border
of the image cuts the body, and in a box that is broad for a walker (a person who sits, or behind a
table), taller bodies are tried, too.  All then vote, each with a weight by how surely the colours
it has learnt decide about the pixels, and by how little its mask falls short of the sides of the
box: a tight box is touched on all of them (Lempitsky et al., Image Segmentation with a Bounding
Box Prior, ICCV 2009).  If the mask leans, be it little, the best hypothesis is tried once more
with templates that lean as much.

A pixel inside the box may be connected with what is outside of it: the minimum barrier distance
(Strand, Ciesielski, Malmberg and Saha, CVIU 2013; by raster scans as in Zhang et al., ICCV 2015)
from the outside is the least range of colours on any path there.  Walls, floor and pillars that
run on into the box are near, a person is not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.colour import BANDS, ColourModel, body_rows, colour_bins
from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.geometry import BodyFrame, Box, body_window
from gait_segmentation.images import axis_tilt, size_of, tanimoto
from gait_segmentation.kernels import kernel
from gait_segmentation.segmentation.graph_cut import (
    contrast_links,
    decided,
    mean_contrast,
    minimum_cut,
    open_graph,
)
from gait_segmentation.starting.hypotheses import VIEWS, Hypothesis, lay_onto

_HEIGHT = 70
"""
Height in pixels to which a taller person is scaled down for the estimate, and a broader one until
the width is half of that.
"""

_ROUNDS = 3
_BAND_SHARE = 0.5
"""Rounds of the maximisation, and weight of the colours of the own height band."""

_PRIOR = 0.45
_TEMPERATURE = 0.03
_MASK_SHARE = 0.9
_VOTE = 0.1
"""How much less sure a result is that has a third of the votes."""

_BROAD, _TALLER = 0.5, (1.5, 2.2)
"""
Width over height from which a box may show less than a whole body, and the heights of bodies tried
then, and of those that the upper or lower border cuts, in heights of the box.
"""

_TILTED, _MOST_TILT = 0.05, 0.5
"""Lean from which, and up to which, leaning templates are tried, in radians."""

_LOOSE = 0.06
"""
How far a given box may be off, as a share of its size: it ends at a border of the image that is
less far away, and beyond it there may be something of the person that stands out.
"""

_TALLEST = 4.0
"""
Tallest body, in the image's longer sides: no box may be larger, and what is thought to go on
beyond the border must stay within what can be matched.
"""

_FLOOR = 3e-5
_LIMIT = 4.0
"""Probability of a colour never seen, and most that colours say, as a logarithm."""

_CONTRAST = 2.0
_FAR = np.float32(1e9)
_LEVEL, _TEXTURE_GAIN = 15.0, 0.7
"""Barrier that says nothing: a constant and a share of the texture's range of colours."""


_Estimate = tuple[float, NDArray[np.bool_], BodyFrame]
"""What comes of a hypothesis: how good it is, (h, w) labels and the body in the window."""


@dataclass(frozen=True)
class FirstMask:
    """
    The first estimate of a person.

    ``mask`` is (h, w) uint8 0/255 of the working image, ``votes`` (h, w) float32 in 0..1 says how
    sure it is, ``box`` is the box it was started from and ``body`` the body frame.  All in working
    pixels.
    """

    mask: NDArray[np.uint8]
    votes: NDArray[np.float32]
    box: Box
    body: BodyFrame


def estimate_first_mask(
    lab: NDArray[np.uint8],
    box: Box,
    bank: TemplateBank,
    evidence: NDArray[np.float32],
    *,
    use_tilt: bool = True,
) -> FirstMask:
    """
    Estimate the first mask.

    :param lab: (h, w, 3) uint8 Lab working image.
    :param box: tight box of the person in working pixels; it may reach out of the image.
    :param bank: templates; all directions are tried.
    :param evidence: (h, w) float32, log-likelihood ratios of the person from elsewhere, 0 where
        nothing is known.
    :param use_tilt: whether the body may lean.
    """
    shape = lab.shape[:2]
    box, cuts = _at_borders(in_view(box, shape), shape)
    window = body_window(box.center_x, box.center_y, box.height, box).slices(*shape[::-1])
    # A box broader than a body shows a part of one that is taller than the box.
    scale = min(1.0, _HEIGHT / max(box.height, box.width / _BROAD))
    rows, columns = (max(4, round(side * scale)) for side in size_of(window))
    lab, evidence = (
        cv2.resize(image[window], (columns, rows), interpolation=cv2.INTER_AREA)
        for image in (lab, evidence)
    )
    small = box.shifted(-window[1].start, -window[0].start).scaled(scale)
    estimator = MaskEstimator(lab, small, evidence)
    whole = not any(cuts[:2]) and box.width <= _BROAD * box.height
    ways = [
        partial(lay_onto, small, bank, (rows, columns), cuts, view, taller, beyond)
        for taller in ((1.0,) if whole else (1.0, *_TALLER))
        for beyond in sorted({False, cuts[2] != cuts[3]})
        for view in VIEWS
    ]
    found = [estimator.maximise(lay()) for lay in ways]
    tilt = axis_tilt((_vote(found) > 0.5).astype(np.uint8))
    tilt = min(max(tilt, -_MOST_TILT), _MOST_TILT)
    if use_tilt and abs(tilt) > _TILTED:
        # Only now, because upright people would be mistaken for leaning ones.
        likely = max(range(len(found)), key=lambda number: found[number][0])
        estimator.lean(tilt)
        # As tall as the box, as the first of the ways are.
        found.append(estimator.maximise(ways[likely % len(VIEWS)](angle=tilt)))
    votes = np.zeros(shape, np.float32)
    across = size_of(window)[::-1]
    votes[window] = cv2.resize(_vote(found), across, interpolation=cv2.INTER_LINEAR)
    mask = np.where(votes > 0.5, 255, 0).astype(np.uint8)
    _, _, body = max(found, key=lambda each: each[0])
    body = body.scaled(1 / scale).shifted(window[1].start, window[0].start)
    tall = min(max(body.height, 1.0), _TALLEST * max(shape))
    body = replace(body, center_y=body.center_y + (tall - body.height) / 2, height=tall)
    return FirstMask(mask, votes, box, body)


def _vote(found: Sequence[_Estimate]) -> NDArray[np.float32]:
    """Return the share of the votes for the person, (h, w) float32; better ones have more."""
    scores = np.array([score for score, _, _ in found], np.float32)
    weights = np.exp((scores - scores.max()) / np.float32(_VOTE))
    weights /= weights.sum()
    votes = np.zeros(found[0][1].shape, np.float32)
    for weight, (_, labels, _) in zip(weights, found, strict=True):
        votes += weight * labels
    # Rounded, the weights of all may come to a little more than one.
    return np.minimum(votes, np.float32(1))


def in_view(box: Box, shape: tuple[int, int]) -> Box:
    """
    Return a box moved so that a pixel of it is in an image of the given (h, w).

    That of a given box may be gone by the margin that it was shrunk by, or by rounding.
    """
    dx = max(1 - box.right, 0.0) + min(shape[1] - 1 - box.x, 0.0)
    dy = max(1 - box.bottom, 0.0) + min(shape[0] - 1 - box.y, 0.0)
    return box.shifted(dx, dy) if dx or dy else box


def _at_borders(box: Box, shape: tuple[int, int]) -> tuple[Box, tuple[bool, bool, bool, bool]]:
    """
    Return a box up to the borders that cut the body, and which those are.

    :param shape: (h, w) of the image.
    :returns: the box, and whether the border cuts at the top, bottom, left and right.
    """
    tall, wide = _LOOSE * box.height, _LOOSE * box.width
    top, bottom = box.y < tall, box.bottom > shape[0] - tall
    left, right = box.x < wide, box.right > shape[1] - wide
    x, y = min(box.x, 0.0) if left else box.x, min(box.y, 0.0) if top else box.y
    end = max(box.right, float(shape[1])) if right else box.right
    low = max(box.bottom, float(shape[0])) if bottom else box.bottom
    return Box(x, y, end - x, low - y), (top, bottom, left, right)


class MaskEstimator:
    """
    The window about a box, at the size the first mask is estimated on.

    ``inside`` is (h, w) bool, where the person may be.
    """

    def __init__(self, lab: NDArray[np.uint8], box: Box, known: NDArray[np.float32]) -> None:
        """
        Prepare a window.

        :param lab: (h, w, 3) uint8.
        :param box: tight box of the person in its pixels.
        :param known: (h, w) float32, log-likelihood ratios of the person from elsewhere, 0 where
            nothing is known.
        """
        shape = lab.shape[:2]
        self._lab, self._bins, self._box = lab, colour_bins(lab), box
        self.inside = inside = np.zeros(shape, np.bool_)
        inside[box.slices(*shape[::-1])] = True
        self._evidence = barrier_evidence(lab, inside)
        # Where it is known what is there the box need not be exact.
        room = box.padded(_LOOSE * box.height, _LOOSE * box.height).slices(*shape[::-1])
        inside[room] |= known[room] > 0
        self._evidence += known * inside
        self._contrast = mean_contrast(open_graph(np.where(inside, 0, -1).astype(np.int8)), lab)
        # One of the person, one of the surroundings: learnt anew for each soft mask.
        self._models = ColourModel(_BAND_SHARE, _FLOOR), ColourModel(_BAND_SHARE, _FLOOR)
        self.lean(0.0)

    def lean(self, angle: float) -> None:
        """Let the bands of colours lean, by an angle in radians."""
        center = self._box.center_x, self._box.center_y
        self._rows = body_rows(self._lab.shape[:2], (0, 0), center, self._box.height, angle)

    def maximise(self, hypothesis: Hypothesis) -> _Estimate:
        """Return what comes of one hypothesis."""
        soft = hypothesis.average(hypothesis.weight)
        colours = self._colours(soft * soft * self.inside, (~self.inside).astype(np.float32))
        prior = _prior(soft)
        for _ in range(_ROUNDS):
            logit = colours + self._evidence
            likelihood = np.round(255 / (1 + np.exp(-logit - prior))).astype(np.uint8)
            similarity = tanimoto(hypothesis.templates, likelihood)
            weights = hypothesis.weight * np.exp((similarity - similarity.max()) / _TEMPERATURE)
            soft = hypothesis.average(weights)
            prior = _prior(soft)
            logit += prior
            graph = open_graph(np.where(self.inside, decided(logit), np.int8(-1)))
            contrast_links(graph, self._lab, _CONTRAST, self._contrast)
            labels = minimum_cut(graph, logit.reshape(-1)[graph.pixels])
            person = np.float32(_MASK_SHARE) * labels + np.float32(1 - _MASK_SHARE) * soft
            colours = self._colours(person, 1 - person)
        sure = float(np.abs(colours[self.inside]).mean())
        return sure - self.gap(labels), labels, hypothesis.bodies[int(weights.argmax())]

    def _colours(self, *weights: NDArray[np.float32]) -> NDArray[np.float32]:
        """
        Return ln p(person) / p(surroundings) of all pixels by their colours, within +-4.

        :param weights: (h, w) float32 in 0..1, of the pixels that the colours of the person are
            learnt from, and those of the surroundings.
        """
        bands = np.clip((self._rows * np.float32(BANDS)).astype(np.intp), 0, BANDS - 1)
        for model, weight in zip(self._models, weights, strict=True):
            model.accumulate(self._bins, self._rows, weight, 1.0)
        found = [np.log(model.table[self._bins, bands]) for model in self._models]
        return np.clip(found[0] - found[1], -_LIMIT, _LIMIT)

    def gap(self, labels: NDArray[np.bool_]) -> float:
        """
        Return by how much a mask falls short of the sides of where the person may be.

        :param labels: (h, w) bool.
        :returns: sum over the four sides, as shares of the width and height; 2 for no mask.
        """
        whole, found = Box.around(self.inside), Box.around(labels)
        if whole is None or found is None:
            return 2.0
        return 2.0 - found.width / whole.width - found.height / whole.height


def _prior(soft: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the log-odds of the person by a soft mask, (h, w) float32."""
    return np.float32(_PRIOR) * np.log((soft + np.float32(0.06)) / (np.float32(1.06) - soft))


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
    for i in range(height * width):
        row, col = divmod(i if forward else height * width - 1 - i, width)
        for y, x in ((row + step, col), (row, col + step)):
            if not (0 <= y < height and 0 <= x < width) or distance[y, x] >= _FAR:
                continue
            barrier = 0
            for channel in range(3):
                value = image[row, col, channel]
                barrier += max(high[y, x, channel], value) - min(low[y, x, channel], value)
            if barrier < distance[row, col]:
                distance[row, col] = barrier
                for channel in range(3):
                    value = image[row, col, channel]
                    high[row, col, channel] = max(high[y, x, channel], value)
                    low[row, col, channel] = min(low[y, x, channel], value)


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
    for forward in (True, False, True, False):
        _scan(image, distance, high, low, forward)
    return distance


def barrier_evidence(lab: NDArray[np.uint8], inside: NDArray[np.bool_]) -> NDArray[np.float32]:
    """
    Return log-odds of the person by the barrier distance, zero outside of the region.

    What distance is large depends on the texture of the surroundings, and is measured there.

    :param lab: (h, w, 3) uint8.
    :param inside: (h, w) bool, the box.
    :returns: (h, w) float32, limited to +-1.
    """
    if inside.all() or not inside.any():
        return np.zeros(inside.shape, np.float32)
    smooth = cv2.GaussianBlur(lab, (3, 3), 0)
    kernel = np.ones((5, 5), np.uint8)
    spread = cv2.absdiff(cv2.dilate(smooth, kernel), cv2.erode(smooth, kernel))
    texture = float(np.median(spread[~inside].sum(axis=1, dtype=np.int32)))
    neutral = np.float32(_LEVEL + _TEXTURE_GAIN * texture)
    return np.minimum(barrier_distance(smooth, inside) / neutral - 1, 1) * inside

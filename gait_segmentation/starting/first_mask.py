# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The first mask from a box alone: a joint estimate over views, colours and the cut.

For each direction of walking, expectation maximisation alternates between the colours of person
and surroundings, the weights of the templates laid onto the box, and a graph cut.  In a box that
is broad for a walker, bodies taller than it (a person who sits, or behind a table) and bodies at
either side of it (a person who reaches out) are tried, too.  All then vote, each with a weight by
how surely the colours it has learnt decide about the pixels, and by how little its mask falls
short of the sides of the box: a tight box is touched on all of them (Lempitsky et al., Image
Segmentation with a Bounding Box Prior, ICCV 2009).  If the mask leans, be it little, the best
directions are tried once more with templates that lean as much.

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
from gait_segmentation.images import axis_tilt, size_of
from gait_segmentation.kernels import kernel
from gait_segmentation.segmentation.graph_cut import (
    contrast_links,
    decided,
    mean_contrast,
    minimum_cut,
    open_graph,
)
from gait_segmentation.starting.hypotheses import VIEWS, Hypothesis, lay_onto

# Height in pixels to which a taller person is scaled down for the estimate, and a broader one
# until its width is 0.75 of that.
_MOST_HEIGHT = 70
_ROUNDS = 3  # of the maximisation
_OWN_BAND = 0.5  # weight of the colours of the own height band
_PRIOR = 0.45  # weight of the templates
_TEMPERATURE = 0.03  # of the weights of templates, in similarity
_MASK_SHARE = 0.9  # of the cut in the soft mask that colours are learnt from
# How much less sure a result is that has a third of the votes, see :meth:`Start.maximise`.
_VOTE = 0.1
# What else is tried in boxes broader than this for their height: how tall the body is for the box,
# and to which side it stands, as far as there is room.
_STANCES = ((1.5, 0.0), (2.2, 0.0), (1.0, -1.0), (1.0, 1.0))
_STANCES_FROM = 0.5
_TILTED = 0.05  # tilt in radians from which templates lean, too
_STEEPEST_TILT = 0.5
# How close to the border of the image a box ends there: in pixels, and of a box broader than a
# whole body, which has this width over its height, as a share of its size.  The margin that a
# given box is shrunk by is less.
_BORDER_PX = 2
_BORDER = 0.09
_BROAD = 0.75
# Tallest body, in the image's longer sides: no box may be larger, and what is thought to go on
# beyond the border must stay within what can be matched.
_TALLEST = 4.0
_LEAST_PROBABILITY = 3e-5  # of a colour, also of one never seen
_MOST_BY_COLOURS = 4.0  # that they say, as a logarithm
_CONTRAST = 2.0  # weight of the links of the cut
# How far beyond the box there may be something of the person that stands out, in heights.
_ROOM = 0.06
_FAR = np.float32(1e9)
# Barrier that says nothing: a constant and a share of the texture's range of colours.
_NEUTRAL_LEVEL = 15.0
_TEXTURE_GAIN = 0.7

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
    scale = min(1.0, _MOST_HEIGHT / max(box.height, box.width / _BROAD))
    rows, columns = (max(4, round(side * scale)) for side in size_of(window))
    lab, evidence = (
        cv2.resize(image[window], (columns, rows), interpolation=cv2.INTER_AREA)
        for image in (lab, evidence)
    )
    small = box.shifted(-window[1].start, -window[0].start).scaled(scale)
    start = Start.about(lab, small, evidence)
    lay = partial(lay_onto, small, bank, (rows, columns), cuts)
    hypotheses = [lay(view) for view in VIEWS]
    if box.width > _STANCES_FROM * box.height:
        for taller, aside in _STANCES:
            # How far a body goes on beyond a border of the image is tried in any case.
            if aside or not any(cuts[:2]):
                hypotheses += [lay(view, taller=taller, aside=aside) for view in VIEWS]
    found = [start.maximise(each) for each in hypotheses]
    tilt = axis_tilt((_vote(found) > 0.5).astype(np.uint8))
    tilt = min(max(tilt, -_STEEPEST_TILT), _STEEPEST_TILT)
    if use_tilt and abs(tilt) > _TILTED:
        # Only now, because upright people would be mistaken for leaning ones.
        likely = max(range(len(found)), key=lambda number: found[number][0])
        center = small.center_x, small.center_y
        start = replace(start, rows=body_rows(lab.shape[:2], (0, 0), center, small.height, tilt))
        found.append(start.maximise(lay(hypotheses[likely].view, tilt)))
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
    """Return a box moved so that a pixel of it, if only of its margin, is in an image (h, w)."""
    dx = max(1 - box.right, 0.0) + min(shape[1] - 1 - box.x, 0.0)
    dy = max(1 - box.bottom, 0.0) + min(shape[0] - 1 - box.y, 0.0)
    return box.shifted(dx, dy) if dx or dy else box


def _at_borders(box: Box, shape: tuple[int, int]) -> tuple[Box, tuple[bool, bool, bool, bool]]:
    """Return a box up to the borders that cut the body: top, bottom, left and right, or not."""
    broad = box.width > _BROAD * box.height
    tall = max(_BORDER_PX, _BORDER * box.height) if broad else _BORDER_PX
    wide = max(_BORDER_PX, _BORDER * box.width)
    top, bottom = box.y < tall, box.bottom > shape[0] - tall
    left, right = box.x < wide, box.right > shape[1] - wide
    x, y = min(box.x, 0.0) if left else box.x, min(box.y, 0.0) if top else box.y
    end = max(box.right, float(shape[1])) if right else box.right
    low = max(box.bottom, float(shape[0])) if bottom else box.bottom
    return Box(x, y, end - x, low - y), (top, bottom, left, right)


@dataclass(frozen=True)
class Start:
    """
    The window about the box at the size the first mask is estimated on.

    ``lab`` is (h, w, 3) uint8 and ``bins`` (h, w) its colour bins, ``rows`` (h, w) float32 how
    far down the body, ``inside`` (h, w) bool where the person may be, ``evidence`` (h, w) float32
    are log-odds of the person that do not change, ``contrast`` is the mean one there.  The models
    of the ``person`` and of the ``rest`` are learnt anew for each soft mask.
    """

    lab: NDArray[np.uint8]
    bins: NDArray[np.uint16]
    rows: NDArray[np.float32]
    inside: NDArray[np.bool_]
    evidence: NDArray[np.float32]
    contrast: float
    person: ColourModel
    rest: ColourModel

    @classmethod
    def about(cls, lab: NDArray[np.uint8], box: Box, known: NDArray[np.float32]) -> Start:
        """Prepare a window with a tight box, of which :func:`estimate_first_mask` is told."""
        shape = lab.shape[:2]
        inside = np.zeros(shape, np.bool_)
        inside[box.slices(*shape[::-1])] = True
        evidence = barrier_evidence(lab, inside)
        # Where it is known what is there the box need not be exact.
        room = box.padded(_ROOM * box.height, _ROOM * box.height).slices(*shape[::-1])
        inside[room] |= known[room] > 0
        evidence += known * inside
        rows = body_rows(shape, (0, 0), (box.center_x, box.center_y), box.height)
        contrast = mean_contrast(open_graph(np.where(inside, 0, -1).astype(np.int8)), lab)
        person, rest = (ColourModel(_OWN_BAND, _LEAST_PROBABILITY) for _ in range(2))
        return cls(lab, colour_bins(lab), rows, inside, evidence, contrast, person, rest)

    def maximise(self, hypothesis: Hypothesis) -> _Estimate:
        """Return what comes of one hypothesis."""
        shape = self.inside.shape
        soft = hypothesis.average(hypothesis.weight, shape)
        rest = (~self.inside).astype(np.float32)
        colours = self._colours(soft * soft * self.inside, rest)
        prior = _logit(soft)
        for _ in range(_ROUNDS):
            logit = colours + self.evidence
            likelihood = 1 / (1 + np.exp(-logit - np.float32(_PRIOR) * prior))
            similarity = hypothesis.similarities(likelihood)
            best = int(np.argmax(similarity * (hypothesis.weight > 0.01)))
            weights = hypothesis.weight * np.exp((similarity - similarity.max()) / _TEMPERATURE)
            soft = hypothesis.average(weights, shape)
            prior = _logit(soft)
            labels = self._cut(logit + np.float32(_PRIOR) * prior)
            weight = np.float32(_MASK_SHARE) * labels + np.float32(1 - _MASK_SHARE) * soft
            colours = self._colours(weight, 1 - weight)
        sure = float(np.abs(colours[self.inside]).mean())
        return sure - self.gap(labels), labels, hypothesis.body(best)

    def _colours(
        self, person: NDArray[np.float32], rest: NDArray[np.float32]
    ) -> NDArray[np.float32]:
        """Return log-odds by the colours learnt from soft masks, all (h, w) float32."""
        bands = np.clip((self.rows * np.float32(BANDS)).astype(np.intp), 0, BANDS - 1)
        found = []
        for model, weight in ((self.person, person), (self.rest, rest)):
            model.accumulate(self.bins, self.rows, weight, 1.0)
            found.append(np.log(model.table[self.bins, bands]))
        return np.clip(found[0] - found[1], -_MOST_BY_COLOURS, _MOST_BY_COLOURS)

    def _cut(self, logit: NDArray[np.float32]) -> NDArray[np.bool_]:
        """Return the cut of least energy with a data term, (h, w) float32."""
        graph = open_graph(np.where(self.inside, decided(logit), np.int8(-1)))
        contrast_links(graph, self.lab, _CONTRAST, self.contrast)
        return minimum_cut(graph, logit.reshape(-1)[graph.pixels])

    def gap(self, labels: NDArray[np.bool_]) -> float:
        """Return by what shares a (h, w) mask is less wide and high than ``inside``, 0 to 2."""
        whole, found = Box.around(self.inside), Box.around(labels)
        if whole is None or found is None:
            return 2.0
        return 2.0 - found.width / whole.width - found.height / whole.height


def _logit(soft: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.log((soft + np.float32(0.06)) / (np.float32(1.06) - soft))


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
    Return the minimum barrier distance of each pixel from the outside of a region, (h, w) bool.

    It is (h, w) float32, in grey levels summed over the channels; 1e9 if all is inside.
    """
    distance = np.where(inside, _FAR, np.float32(0)).astype(np.float32)
    high, low = image.copy(), image.copy()
    for forward in (True, False, True, False):
        _scan(image, distance, high, low, forward)
    return distance


def barrier_evidence(lab: NDArray[np.uint8], inside: NDArray[np.bool_]) -> NDArray[np.float32]:
    """
    Return log-odds of the person by the barrier distance, (h, w) float32 within +-1.

    What distance is large depends on the texture of the surroundings, and is measured there.
    """
    if inside.all() or not inside.any():
        return np.zeros(inside.shape, np.float32)
    smooth = cv2.GaussianBlur(lab, (3, 3), 0)
    kernel = np.ones((5, 5), np.uint8)
    spread = cv2.absdiff(cv2.dilate(smooth, kernel), cv2.erode(smooth, kernel))
    texture = float(np.median(spread[~inside].sum(axis=1, dtype=np.int32)))
    neutral = np.float32(_NEUTRAL_LEVEL + _TEXTURE_GAIN * texture)
    return np.minimum(barrier_distance(smooth, inside) / neutral - 1, 1) * inside

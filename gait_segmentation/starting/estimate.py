# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The first mask from a box alone: a joint estimate over views, colours and the cut.

For each direction of walking, expectation maximisation alternates between the colours of person
and surroundings, the weights of the templates laid onto the box, and a graph cut.  In a box that
is broad for a walker, bodies taller than it (somebody who sits, or behind a table) and bodies at
either side of it (somebody who reaches out) are tried, too.  All then vote, each with a weight by
how surely the colours it has learnt decide about the pixels, and by how little its mask falls
short of the sides of the box: a tight box is touched on all of them (Lempitsky et al., Image
Segmentation with a Bounding Box Prior, ICCV 2009).  If the mask leans, be it little, the best
directions are tried once more with templates that lean as much.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.geometry import BodyFrame, Box, body_window
from gait_segmentation.images import axis_tilt, size_of
from gait_segmentation.starting.first_scene import FirstScene, first_scene
from gait_segmentation.starting.hypotheses import VIEWS, Hypothesis, fit_view

_HEIGHT = 70
"""
Height in pixels to which a taller person is scaled down for the estimate, and a broader one until
its width is 0.75 of that.
"""

_FIRST_SHARE, _SHARES = 0.3, (0.3, 0.7, 0.7)
"""Weight of the colours of the own height band before and after each round."""

_LIKELIHOOD_PRIOR, _CUT_PRIOR = 0.5, 0.45
_TEMPERATURE = 0.03
_MASK_SHARE = 0.9
_VOTE = 0.1
"""How much less sure a result is that has a third of the votes, see :func:`_maximise`."""

_STANCES = ((1.5, 0.0), (2.2, 0.0), (1.0, -1.0), (1.0, 1.0))
_STANCES_FROM = 0.5
"""
What else is tried in boxes broader than this for their height: how tall the body is for the box,
and to which side it stands, as far as there is room.
"""

_TILTED, _TILTED_VIEWS, _MOST_TILT = 0.05, 2, 0.5
_BORDER_PX, _BORDER = 2, 0.09
_BROAD = 0.75
"""
How close to the border of the image a box ends there: in pixels, and of a box broader than a whole
body, which has this width over its height, as a share of its size.  The margin that a given box is
shrunk by is less.
"""

_TALLEST = 4.0
"""
Tallest body, in the image's longer sides: no box may be larger, and what is thought to go on
beyond the border must stay within what can be matched.
"""


@dataclass(frozen=True)
class Start:
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


@dataclass(frozen=True)
class _Result:
    """What came of a hypothesis: mask (h, w), how good it is, and its best template."""

    hypothesis: Hypothesis
    labels: NDArray[np.bool_]
    score: float
    template: int


def estimate_start(
    lab: NDArray[np.uint8],
    box: Box,
    bank: TemplateBank,
    *,
    use_tilt: bool = True,
    evidence: NDArray[np.float32] | None = None,
) -> Start:
    """
    Estimate the first mask.

    :param lab: (h, w, 3) uint8 Lab working image.
    :param box: tight box of the person in working pixels; it may reach out of the image.
    :param bank: templates; all directions are tried.
    :param use_tilt: whether the body may lean.
    :param evidence: (h, w) float32, log-likelihood ratios of the person from elsewhere, 0 where
        nothing is known.
    """
    shape = lab.shape[:2]
    box = in_view(box, shape)
    box, cuts = _at_borders(box, shape)
    area = body_window(box.center_x, box.center_y, box.height, box)
    window = area.slices(shape[1], shape[0])
    part = lab[window]
    # A box broader than a body shows a part of one that is taller than the box.
    scale = min(1.0, _HEIGHT / max(box.height, box.width / _BROAD))
    size = (max(4, round(part.shape[0] * scale)), max(4, round(part.shape[1] * scale)))
    if size != part.shape[:2]:
        part = cv2.resize(part, size[::-1], interpolation=cv2.INTER_AREA)
    small = box.shifted(-window[1].start, -window[0].start).scaled(scale)
    known = None
    if evidence is not None:
        known = cv2.resize(evidence[window], size[::-1], interpolation=cv2.INTER_AREA)
    scene = first_scene(np.ascontiguousarray(part), small, known)
    fit = partial(fit_view, bank, small, size, cuts)
    hypotheses = [fit(view) for view in VIEWS]
    if box.width > _STANCES_FROM * box.height:
        for taller, aside in _STANCES:
            # How far a body goes on beyond a border of the image is tried in any case.
            if aside or not any(cuts[:2]):
                hypotheses += [fit(view, taller=taller, aside=aside) for view in VIEWS]
    results = [_maximise(hypothesis, scene) for hypothesis in hypotheses]
    tilt = axis_tilt((_vote(results) > 0.5).astype(np.uint8))
    tilt = min(max(tilt, -_MOST_TILT), _MOST_TILT)
    if use_tilt and abs(tilt) > _TILTED:
        # Only now, because upright people would be mistaken for leaning ones.
        likely = sorted(results, key=lambda result: -result.score)[:_TILTED_VIEWS]
        scene = scene.turned(small, tilt)
        results += [_maximise(fit(each.hypothesis.azimuth, tilt), scene) for each in likely]
    best = max(results, key=lambda result: result.score)
    hypothesis, template = best.hypothesis, best.template
    votes = np.zeros(shape, np.float32)
    across = size_of(window)[::-1]
    votes[window] = cv2.resize(_vote(results), across, interpolation=cv2.INTER_LINEAR)
    mask = np.where(votes > 0.5, 255, 0).astype(np.uint8)
    tall = float(hypothesis.height[template]) / scale
    tall = min(max(tall, 1.0), _TALLEST * max(shape))
    body = BodyFrame(
        window[1].start + float(hypothesis.axis[template]) / scale,
        window[0].start + float(hypothesis.top[template]) / scale + tall / 2,
        tall,
        hypothesis.angle,
    )
    return Start(mask, votes, box, body)


def _vote(results: Sequence[_Result]) -> NDArray[np.float32]:
    """Return the share of the votes for the person, (h, w) float32; better results have more."""
    scores = np.array([result.score for result in results], np.float32)
    weights = np.exp((scores - scores.max()) / np.float32(_VOTE))
    weights /= weights.sum()
    votes = np.zeros(results[0].labels.shape, np.float32)
    for weight, result in zip(weights, results, strict=True):
        votes += weight * result.labels
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
    broad = box.width > _BROAD * box.height
    tall = max(_BORDER_PX, _BORDER * box.height) if broad else _BORDER_PX
    wide = max(_BORDER_PX, _BORDER * box.width)
    top, bottom = box.y < tall, box.bottom > shape[0] - tall
    left, right = box.x < wide, box.right > shape[1] - wide
    x, y = min(box.x, 0.0) if left else box.x, min(box.y, 0.0) if top else box.y
    end = max(box.right, float(shape[1])) if right else box.right
    low = max(box.bottom, float(shape[0])) if bottom else box.bottom
    return Box(x, y, end - x, low - y), (top, bottom, left, right)


def _maximise(hypothesis: Hypothesis, scene: FirstScene) -> _Result:
    """Return what comes of one hypothesis."""
    soft = hypothesis.average(hypothesis.weight, scene.shape, 0.015 * scene.height)
    rest = (~scene.inside).astype(np.float32)
    logit = scene.logit(soft * soft * scene.inside, rest, _FIRST_SHARE)
    prior = _logit_of(soft)
    for share in _SHARES:
        known = logit + scene.evidence
        likelihood = _sigmoid(known + np.float32(_LIKELIHOOD_PRIOR) * prior)
        similarity = hypothesis.similarities(likelihood)
        best = int(np.argmax(similarity * (hypothesis.weight > 0.01)))
        weights = hypothesis.weight * np.exp((similarity - similarity.max()) / _TEMPERATURE)
        soft = hypothesis.average(weights, scene.shape, 0.01 * scene.height)
        prior = _logit_of(soft)
        labels = scene.cut(known + np.float32(_CUT_PRIOR) * prior)
        weight = np.float32(_MASK_SHARE) * labels + np.float32(1 - _MASK_SHARE) * soft
        logit = scene.logit(weight, 1 - weight, share)
    sure = float(np.abs(logit[scene.inside]).mean()) if scene.inside.any() else 0.0
    return _Result(hypothesis, labels, sure - scene.gap(labels), best)


def _sigmoid(logit: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.asarray(1 / (1 + np.exp(-logit)), np.float32)


def _logit_of(soft: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.log((soft + np.float32(0.06)) / (np.float32(1.06) - soft))

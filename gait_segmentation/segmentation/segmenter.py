# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The segmentation stage: likelihood, image and shape prior in, silhouette out."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import InputError
from gait_segmentation.geometry import (
    BodyFrame,
    Box,
    body_window,
    check_body,
    pixel_affine,
    template_to_image,
)
from gait_segmentation.images import (
    Window,
    check_image,
    check_map,
    distance_from,
    same_proportions,
    shrink,
    signed_distance,
)
from gait_segmentation.paper.prior import shape_terms
from gait_segmentation.paper.vocabulary import Vocabulary, default_vocabulary
from gait_segmentation.results import MatchResult, SegmentationResult
from gait_segmentation.segmentation.config import SegmentationConfig
from gait_segmentation.segmentation.graph_cut import (
    contrast_links,
    decided,
    distance_links,
    finest,
    minimum_cut,
    open_graph,
    refine,
    upsample,
)

# Pixels about a body in which it is cut out: three times what the tracker's working height asks
# for.  A cut takes 0.6 kB for each.
_MOST_CUT_PIXELS = 2**18
# Height of a body, in the image's longer sides, from which none of its outline can be seen.
_LARGEST = 8.0
# Share of a frame in the running mean of the fit, which begins at 1: half a step.
_FIT_RATE = 1 / 7
_NOBODY = 'the cut found no person'
_LARGEST_EVIDENCE = 10.0  # log-odds that what is far from the paper's template must outweigh
_LARGEST_ODDS = 3.0  # largest log-odds that the default prior gives, before its weight
_LOGIT = np.log((np.arange(256) + 0.5) / (255.5 - np.arange(256))).astype(np.float32)

_MAP_SIDE = 96  # rows and columns of the map of the body
_FILL = 0.75  # share of them that its height takes
# Share of a frame in the running mean: what is likely from now on counts after fourteen frames, in
# which a wide thing that stays behind has moved on.
_MAP_RATE = 0.05
# Summed support of a part, as a share of the best one's, from which it may stay.
_LEAST_OVERLAP = 0.04
_APART = 0.12  # distance from the template, in body heights, beyond which nothing supports a part


class Segmenter:
    """Cuts one person out of frame after frame."""

    def __init__(self, config: SegmentationConfig | None = None) -> None:
        """Have learnt nothing; VocabularyError if the vocabulary that is named cannot be used."""
        self.config = config or SegmentationConfig()
        """In force; it may be exchanged between frames, all but the vocabulary."""

        # Also for other priors: the configuration may be exchanged, and a bad file is refused now.
        self._vocabulary = vocabulary_of(self.config)
        self._start_track(0)

    def _start_track(self, track_id: int) -> None:
        self._track_id = track_id
        self._fit = 1.0
        self._mean = MeanLikelihood()
        self._last: Box | None = None

    def segment(
        self,
        image: NDArray[np.uint8],
        likelihood: NDArray[np.uint8],
        match: MatchResult,
        occluded: NDArray[np.uint8] | None = None,
    ) -> SegmentationResult:
        """
        Segment one frame, which :class:`PeopleSegmenter` has checked.

        :param image: (H, W, 3) uint8 BGR, the source frame with the stamp of ``match``.
        :param likelihood: (h, w) uint8, its foreground likelihood image at working size.
        :param match: the matched template of that frame.
        :param occluded: (H, W) uint8, non-zero where a nearer person occludes this one.
        """
        if match.track_id != self._track_id:
            self._start_track(match.track_id)
        config, (height, width) = self.config, image.shape[:2]
        if match.body is None:
            gone = 'the person is hidden or gone'
            return self._empty(image, match, gone if match.track_id else 'no person is tracked')
        if match.body.height > _LARGEST * max(height, width):
            return self._empty(image, match, 'the person is far larger than the image')
        likelihood, full_prior = no_finer(likelihood, match.shape_prior, match.body, width)
        scale = likelihood.shape[1] / width
        body = match.body.scaled(scale)
        window = window_about(body, self._last, likelihood.shape)
        values = likelihood[window]
        if values.size == 0:
            return self._empty(image, match, 'the person is outside of the image')
        crop = source_window(window, scale, (height, width))
        # What is finer than the outline is cut is scaled down once, and all work on that.
        source = finest(image[crop], values.shape)
        if occluded is not None:
            values = values.copy()
            values[shrink(occluded[crop], values.shape) > 127] = 0
        lab = cv2.cvtColor(shrink(source, values.shape), cv2.COLOR_BGR2Lab)
        prior, place = full_prior[window], body.shifted(-window[1].start, -window[0].start)
        odds, psi = self._prior_terms(prior, lab, place)
        logit = _LOGIT[values]
        if odds is not None:
            logit = logit + odds
        labels = self._solve(lab, logit, psi)
        if config.use_support:
            labels = self._supported(labels, values, None if odds is None else prior, place)
        found = Box.around(labels)
        if found is None:
            return self._empty(image, match, _NOBODY)
        self._last = found.shifted(window[1].start, window[0].start)
        self._update_fit(match.similarity, labels, values)
        self._mean.add_frame(values, place)
        if config.use_refinement:
            labels = refine(source, labels, logit, config.contrast)
        mask = at_full_size(labels, crop, (height, width))
        if occluded is not None:
            mask[crop][occluded[crop] > 0] = 0
        if not mask[crop].any():
            # Of so little that none of it is left at full resolution, or off those before.
            return self._empty(image, match, _NOBODY)
        return SegmentationResult(match.stamp_ns, match.track_id, mask, '')

    def _supported(
        self,
        labels: NDArray[np.bool_],
        values: NDArray[np.uint8],
        prior: NDArray[np.uint8] | None,
        body: BodyFrame,
    ) -> NDArray[np.bool_]:
        """Return the cut without what neither the likelihood nor the prior, if any, supports."""
        support, known = values.astype(np.float32) / np.float32(255), None
        if prior is not None:
            support = (support + prior / np.float32(255)) / 2
            known = (prior > 127) | self._mean.at(body, prior.shape)
        return keep_supported(labels, support, known, body.height)

    def _solve(
        self, lab: NDArray[np.uint8], logit: NDArray[np.float32], psi: NDArray[np.float32] | None
    ) -> NDArray[np.bool_]:
        """Return the cut of least energy."""
        graph = open_graph(decided(logit))
        contrast_links(graph, lab, self.config.contrast)
        if psi is not None:
            distance_links(graph, psi, self.config.paper_weight)
        return minimum_cut(graph, logit.reshape(-1)[graph.pixels])

    def _prior_terms(
        self, prior: NDArray[np.uint8], lab: NDArray[np.uint8], body: BodyFrame
    ) -> tuple[NDArray[np.float32] | None, NDArray[np.float32] | None]:
        """Return log-odds and costs of a cut by the prior, (h, w), None if it says nothing."""
        config, inside = self.config, prior > 127
        trust = 1.0
        if config.fit_low < config.fit_high:
            trust = (self._fit - config.fit_low) / (config.fit_high - config.fit_low)
            trust = min(max(trust, 0.0), 1.0)
        if config.prior == 'none' or not trust or not inside.any():
            return None, None
        if config.prior == 'paper':
            grey = lab[:, :, 0]
            found = shape_terms(prior, grey, body, self._vocabulary, **paper_parameters(config))
            if found is None:
                return None, None
            # What no evidence and no links, of both n-links to eight neighbours, can outweigh.
            links = (4 + 4 / math.sqrt(2)) * (config.contrast + config.paper_weight)
            never = np.float32(-(_LARGEST_EVIDENCE + links))
            odds = np.where(found.far, never, np.float32(0))
            return odds * np.float32(trust == 1), np.float32(trust) * found.psi
        # Linear in the distance, as PoseCut's (Bray, Kohli, Torr, ECCV 2006).  As steep inside:
        # limbs are thin, so that what hides a leg or where it is a phase ahead is for the
        # likelihood to say.
        steps = signed_distance(inside) / np.float32(config.template_slope * body.height)
        odds = np.clip(steps, -_LARGEST_ODDS, _LARGEST_ODDS)
        return np.float32(trust * config.template_weight) * odds, None

    def _update_fit(
        self, similarity: float, labels: NDArray[np.bool_], evidence: NDArray[np.uint8]
    ) -> None:
        """Note how well the template explains a likelihood, over how well the mask does."""
        inside = float(evidence[labels].sum(dtype=np.int64))
        either = 255.0 * np.count_nonzero(labels) + float(evidence.sum(dtype=np.int64)) - inside
        if inside > 0:
            fit = min(similarity * either / inside, 1.0)
            self._fit += _FIT_RATE * (fit - self._fit)

    def _empty(
        self, image: NDArray[np.uint8], match: MatchResult, reason: str
    ) -> SegmentationResult:
        self._last = None
        mask = np.zeros(image.shape[:2], np.uint8)
        return SegmentationResult(match.stamp_ns, match.track_id, mask, reason)


def vocabulary_of(config: SegmentationConfig) -> Vocabulary:
    """Return the words of the paper's prior; VocabularyError if its file cannot be used."""
    return Vocabulary.load(config.vocabulary) if config.vocabulary else default_vocabulary()


def paper_parameters(config: SegmentationConfig) -> dict[str, float]:
    """Return the parameters ``paper_...`` by the names they have in the paper's prior."""
    return {
        'reach': config.paper_reach,
        'depth': config.paper_depth,
        'orientation': config.paper_orientation,
        'search': config.paper_search,
        'unconfirmed': config.paper_edge_factor,
    }


def no_finer(
    likelihood: NDArray[np.uint8], prior: NDArray[np.uint8], body: BodyFrame, width: int
) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """
    Return a likelihood and a shape prior, smaller if they show a body finer than it is cut out.

    :param likelihood, prior: (h, w) uint8.
    :param body: in pixels of the image.
    :param width: of the image.
    """
    pixels = likelihood.size
    if pixels > _MOST_CUT_PIXELS:
        small = body.scaled(likelihood.shape[1] / width)
        pixels = likelihood[window_about(small, None, likelihood.shape)].size
    if pixels <= _MOST_CUT_PIXELS:
        return likelihood, prior
    factor = (_MOST_CUT_PIXELS / pixels) ** 0.5
    height, across = (max(1, round(factor * size)) for size in likelihood.shape)
    return shrink(likelihood, (height, across)), shrink(prior, (height, across))


def window_about(body: BodyFrame, last: Box | None, shape: tuple[int, int]) -> Window:
    """
    Return the window in which a body is cut out, which may be empty.

    :param body: the body in working pixels.
    :param last: what was found of it in the frame before, which the window then holds as well.
    :param shape: (h, w) of the working image.
    """
    box = body_window(body.center_x, body.center_y, body.height)
    if last is not None and last.iou(box) > 0:
        box = body_window(body.center_x, body.center_y, body.height, last)
    return box.slices(shape[1], shape[0])


def source_window(window: Window, scale: float, shape: tuple[int, int]) -> Window:
    """
    Return the rows and columns of the source that a window of the working image covers.

    :param scale: from source to working pixels.
    :param shape: (H, W) of the source.
    """
    rows, columns = (
        slice(min(round(each.start / scale), size), min(round(each.stop / scale), size))
        for each, size in zip(window, shape, strict=True)
    )
    return rows, columns


def at_full_size(
    labels: NDArray[np.bool_], crop: Window, size: tuple[int, int]
) -> NDArray[np.uint8]:
    """Return the mask of an image of (H, W), 0/255, by labels of any size for a window of it."""
    mask = np.zeros(size, np.uint8)
    part = mask[crop]
    np.multiply(upsample(labels, part.shape).view(np.uint8), np.uint8(255), out=part)
    return mask


class MeanLikelihood:
    """
    Running mean of the likelihood in the frame of the body.

    What passes by, and what was taken for the person at first and stays behind, is soon at
    another place on the body; a bag in the hand is not.
    """

    def __init__(self) -> None:
        self._mean = np.zeros((_MAP_SIDE, _MAP_SIDE), np.float32)

    def at(self, body: BodyFrame, shape: tuple[int, ...]) -> NDArray[np.bool_]:
        """Return what was mostly likely until now, (h, w) bool, for a body in an image."""
        matrix = _matrix(body)
        return np.asarray(cv2.warpAffine(self._mean, matrix, (shape[1], shape[0])) > 0.5)

    def add_frame(self, likelihood: NDArray[np.uint8], body: BodyFrame) -> None:
        """Update the mean with a likelihood, (h, w) uint8, and the body in its pixels."""
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        now = cv2.warpAffine(likelihood, _matrix(body), (_MAP_SIDE, _MAP_SIDE), flags=flags)
        cv2.accumulateWeighted(now / np.float32(255), self._mean, _MAP_RATE)


def _matrix(body: BodyFrame) -> NDArray[np.float64]:
    return pixel_affine(template_to_image(body, _MAP_SIDE, _MAP_SIDE, _FILL * _MAP_SIDE))


def keep_supported(
    labels: NDArray[np.bool_],
    support: NDArray[np.float32],
    body: NDArray[np.bool_] | None,
    height: float,
) -> NDArray[np.bool_]:
    """
    Keep the components with more than 4 % of the largest one's support.

    Of a part that lies mostly apart from the body nothing counts: that is a passer-by.

    :param labels: (h, w) bool, the cut.
    :param support: (h, w) float32 in 0..1, where the person is expected.
    :param body: (h, w) bool, where the template is; None if that is not known.
    :param height: height of the body in pixels.
    """
    count, parts = cv2.connectedComponents(labels.view(np.uint8), connectivity=4)
    if count <= 2:
        return labels
    overlap = np.bincount(parts.ravel(), support.ravel(), count)
    overlap[0] = 0
    if body is not None and body.any():
        away = distance_from(body)
        apart = np.bincount(parts.ravel(), (away > _APART * height).ravel(), count)
        overlap[2 * apart > np.bincount(parts.ravel(), minlength=count)] = 0
    return np.asarray((overlap > _LEAST_OVERLAP * overlap.max())[parts])


@dataclass(frozen=True)
class PeopleMasks:
    """
    The silhouettes of all people in one frame.

    ``people`` has one result a slot.  ``mask`` is (H, W) uint8 0/255, their union; ``labels`` is
    (H, W) uint8, 0 or slot + 1.  No pixel belongs to two people.
    """

    people: tuple[SegmentationResult, ...]
    mask: NDArray[np.uint8]
    labels: NDArray[np.uint8]


class PeopleSegmenter:
    """
    Cuts several people out of frame after frame.

    Where they overlap they are cut out from the nearest to the farthest, and what one has got the
    next cannot have: each pixel has one owner.  Nearer is who has the lower feet.
    """

    def __init__(self, config: SegmentationConfig | None = None, *, max_people: int = 1) -> None:
        """Make a segmenter for each slot."""
        config = config or SegmentationConfig()
        self._slots = [Segmenter(config) for _ in range(max_people)]

    @property
    def config(self) -> SegmentationConfig:
        """Return the configuration, which may be exchanged between frames, but the vocabulary."""
        return self._slots[0].config

    @config.setter
    def config(self, config: SegmentationConfig) -> None:
        for slot in self._slots:
            slot.config = config

    def reset(self) -> None:
        """Drop all that is learnt of the people."""
        self._slots = [Segmenter(self.config) for _ in self._slots]

    def update(
        self,
        image: NDArray[np.uint8],
        likelihoods: Sequence[NDArray[np.uint8]],
        matches: Sequence[MatchResult],
    ) -> PeopleMasks:
        """
        Segment one frame.

        :param image: (H, W, 3) uint8 BGR, the source frame with the stamp of the matches.
        :param likelihoods: (h, w) uint8, the foreground likelihood image of each slot.
        :param matches: the matched template of each slot.
        :raises InputError: if shapes or types do not fit, or a body makes no sense.
        """
        check_image(image)
        if not len(likelihoods) == len(matches) == len(self._slots):
            raise InputError(
                f'there must be {len(self._slots)} likelihoods and matches, one a slot, got '
                f'{len(likelihoods)} and {len(matches)}'
            )
        for likelihood, match in zip(likelihoods, matches, strict=True):
            # Before the state of any slot is changed.
            prior, shape = match.shape_prior, likelihood.shape
            check_map(likelihood, 'likelihood')
            check_map(prior, 'shape prior')
            if shape != prior.shape:
                raise InputError(
                    f'likelihood and shape prior must have the same size, got {shape} '
                    f'and {prior.shape}'
                )
            smaller = all(size <= whole for size, whole in zip(shape, image.shape, strict=False))
            if not smaller or not same_proportions(shape, image.shape[:2]):
                raise InputError(
                    f'likelihood must have the proportions of the image {image.shape[:2]} and be '
                    f'no larger, got {shape}'
                )
            if match.body is not None:
                check_body(match.body, (image.shape[1], image.shape[0]))
        found: dict[int, SegmentationResult] = {}
        for slot in sorted(range(len(matches)), key=lambda each: -_feet(matches[each])):
            masks = [each.mask for other, each in found.items() if _touch(matches, slot, other)]
            occluded = functools.reduce(np.bitwise_or, masks) if masks else None
            found[slot] = self._slots[slot].segment(
                image, likelihoods[slot], matches[slot], occluded
            )
        people = tuple(found[slot] for slot in range(len(self._slots)))
        mask, labels = np.zeros((2, *image.shape[:2]), np.uint8)
        for slot, each in found.items():
            if not each.reason:
                mask |= each.mask
                labels |= each.mask & np.uint8(slot + 1)
        return PeopleMasks(people, mask, labels)


def _feet(match: MatchResult) -> float:
    """Return how far down the feet are, -inf of nobody."""
    return -math.inf if match.body is None else match.body.feet[1]


def _touch(matches: Sequence[MatchResult], one: int, two: int) -> bool:
    first, second = matches[one].body, matches[two].body
    return first is not None and second is not None and _reach(first).iou(_reach(second)) > 0


def _reach(body: BodyFrame) -> Box:
    """Return the box that a person's mask may fill."""
    return Box.from_center(body.center_x, body.center_y, 1.4 * body.height, 1.4 * body.height)

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The segmentation stage: likelihood, image and shape prior in, silhouette out."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import InputError
from gait_segmentation.geometry import BodyFrame, Box, body_window
from gait_segmentation.images import Window, check_image, shrink
from gait_segmentation.results import MatchResult, SegmentationResult
from gait_segmentation.segmentation.components import fill_holes, keep_supported
from gait_segmentation.segmentation.config import SegmentationConfig
from gait_segmentation.segmentation.energy import contrast_links, distance_links
from gait_segmentation.segmentation.graph_cut import decided, minimum_cut
from gait_segmentation.segmentation.paper_prior import PaperPrior
from gait_segmentation.segmentation.refinement import refine, upsample
from gait_segmentation.segmentation.residual import PersonalShape
from gait_segmentation.segmentation.shape_prior import ShapeTerms, shape_terms

__all__ = ['Segmenter']

_LEAST_AREA = 0.25
"""A mask smaller than this share of the template teaches nothing."""

_LOGIT = np.log((np.arange(256) + 0.5) / (255.5 - np.arange(256))).astype(np.float32)


class Segmenter:
    """Cuts one person out of frame after frame and learns the person's own shape."""

    def __init__(self, config: SegmentationConfig | None = None) -> None:
        """Make a segmenter that has seen nobody."""
        self.config = config or SegmentationConfig()
        self._personal = PersonalShape()
        self._paper = PaperPrior(self.config) if self.config.prior == 'paper' else None
        self._track_id = 0
        self._last: Box | None = None

    def reset(self) -> None:
        """Forget the person."""
        self._personal.reset()
        self._track_id = 0
        self._last = None

    def update(
        self, image: NDArray[np.uint8], likelihood: NDArray[np.uint8], match: MatchResult
    ) -> SegmentationResult:
        """
        Segment one frame.

        :param image: (H, W, 3) uint8 BGR, the source frame with the stamp of ``match``.
        :param likelihood: (h, w) uint8, its foreground likelihood image at working size.
        :param match: the matched template of that frame.
        :raises InputError: if shapes or types do not fit.
        """
        check_image(image)
        self._check(image, likelihood, match)
        if match.track_id != self._track_id:
            self.reset()
            self._track_id = match.track_id
        height, width = image.shape[:2]
        if match.body is None:
            return self._empty(image, match, 'nobody is tracked')
        scale = likelihood.shape[1] / width
        body = match.body.scaled(scale)
        window = self._window(body, likelihood.shape)
        if window[0].start >= window[0].stop or window[1].start >= window[1].stop:
            return self._empty(image, match, 'the person is outside of the image')
        crop = _source_window(window, scale, (height, width))
        source = image[crop]
        labels, logit = self._cut(source, likelihood, match, body, window)
        if not labels.any():
            return self._empty(image, match, 'the cut found no person')
        self._learn(labels, match, body, window)
        if labels.shape == source.shape[:2]:
            fine = labels
        elif self.config.use_refinement:
            fine = refine(source, labels, logit, self.config.contrast)
        else:
            fine = upsample(labels, source.shape[:2])
        mask = np.zeros((height, width), np.uint8)
        mask[crop] = fine.view(np.uint8) * np.uint8(255)
        return SegmentationResult(match.stamp_ns, match.track_id, mask, '')

    def _cut(
        self,
        source: NDArray[np.uint8],
        likelihood: NDArray[np.uint8],
        match: MatchResult,
        body: BodyFrame,
        window: Window,
    ) -> tuple[NDArray[np.bool_], NDArray[np.float32]]:
        """Return the cut at working size and its data term, in the window."""
        evidence = likelihood[window]
        shape = evidence.shape
        lab = cv2.cvtColor(shrink(source, shape), cv2.COLOR_BGR2Lab)
        prior = match.shape_prior[window]
        terms = self._terms(prior, lab, match, body, window)
        logit = _LOGIT[evidence]
        if terms.logit is not None:
            logit = logit + terms.logit
        given = decided(logit)
        links = contrast_links(lab, self.config.contrast, given)
        if terms.psi is not None:
            weight = self.config.distance_weight
            if self._paper is not None:
                weight = self.config.paper_weight
            distance_links(terms.psi, weight, links)
        labels = minimum_cut(logit, links, given)
        support = evidence.astype(np.float32) / np.float32(255)
        if terms.psi is not None:
            support = (support + prior / np.float32(255)) / 2
        labels = keep_supported(labels, support)
        return fill_holes(labels, self.config.hole_area * body.height**2), logit

    def _terms(
        self,
        prior: NDArray[np.uint8],
        lab: NDArray[np.uint8],
        match: MatchResult,
        body: BodyFrame,
        window: Window,
    ) -> ShapeTerms:
        """Return the shape prior's terms in the window."""
        if self._paper is not None:
            return self._paper.terms(prior, lab[:, :, 0], _in_window(body, window))
        personal = None
        if self.config.use_residual and self._personal.ready:
            personal = self._personal.probability(
                prior.shape, _in_window(body, window), match.phase
            )
        return shape_terms(prior, body.height, personal, self.config)

    def _learn(
        self, labels: NDArray[np.bool_], match: MatchResult, body: BodyFrame, window: Window
    ) -> None:
        found = Box.around(labels)
        assert found is not None
        self._last = found.shifted(window[1].start, window[0].start)
        template = np.count_nonzero(match.shape_prior[window] > 127)
        if np.count_nonzero(labels) > _LEAST_AREA * template:
            mask = labels.view(np.uint8) * np.uint8(255)
            self._personal.learn(mask, _in_window(body, window), match.phase)

    def _window(self, body: BodyFrame, shape: tuple[int, int]) -> Window:
        box = body_window(body.center_x, body.center_y, body.height)
        if self._last is not None and self._last.iou(box) > 0:
            box = body_window(body.center_x, body.center_y, body.height, self._last)
        return box.slices(shape[1], shape[0])

    def _empty(
        self, image: NDArray[np.uint8], match: MatchResult, reason: str
    ) -> SegmentationResult:
        self._last = None
        mask = np.zeros(image.shape[:2], np.uint8)
        return SegmentationResult(match.stamp_ns, match.track_id, mask, reason)

    @staticmethod
    def _check(
        image: NDArray[np.uint8], likelihood: NDArray[np.uint8], match: MatchResult
    ) -> None:
        for name, array in (('likelihood', likelihood), ('shape prior', match.shape_prior)):
            if array.ndim != 2 or array.dtype != np.uint8:
                raise InputError(
                    f'{name} must be (height, width) uint8, got {array.shape} {array.dtype}'
                )
        if likelihood.shape != match.shape_prior.shape:
            raise InputError(
                f'likelihood and shape prior must have the same size, got {likelihood.shape} '
                f'and {match.shape_prior.shape}'
            )
        scale = likelihood.shape[1] / image.shape[1]
        if scale > 1 or abs(likelihood.shape[0] - scale * image.shape[0]) > 1:
            raise InputError(
                f'likelihood must have the proportions of the image {image.shape[:2]} and be no '
                f'larger, got {likelihood.shape}'
            )


def _in_window(body: BodyFrame, window: Window) -> BodyFrame:
    return BodyFrame(
        body.center_x - window[1].start,
        body.center_y - window[0].start,
        body.height,
        body.angle,
    )


def _source_window(window: Window, scale: float, shape: tuple[int, int]) -> Window:
    """Return the rows and columns of the source that a working window covers."""
    rows, columns = (
        slice(min(round(part.start / scale), size), min(round(part.stop / scale), size))
        for part, size in zip(window, shape, strict=True)
    )
    return rows, columns

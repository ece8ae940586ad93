# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's shape prior of one frame, step by step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from gait_segmentation.geometry import BodyFrame
from gait_segmentation.images import shrink
from gait_segmentation.paper.prior import ShapeTerms, shape_terms, word_distances, words_of
from gait_segmentation.paper.vocabulary import Vocabulary
from gait_segmentation.segmentation import SegmentationConfig
from gait_segmentation.segmentation.segmenter import paper_parameters, window_about
from gait_tools.figures.walk import Shot
from gait_tools.vocabulary_training import word_colours

WORDS = 4  # words whose distance transforms are shown
DISTANCES = 'viridis_r'  # colours of distances: bright is near


@dataclass(frozen=True)
class PriorSteps:
    """
    The prior in the part (h, w) of a frame in which something is to be worked out.

    ``words`` (n,) are those of the outline points, ``by_word`` (K, h, w) the distance transforms
    of their points, in pixels.
    """

    terms: ShapeTerms
    body: BodyFrame
    image: NDArray[np.uint8]
    inside: NDArray[np.bool_]
    far: NDArray[np.bool_]
    psi: NDArray[np.float32]
    words: NDArray[np.int64]
    by_word: NDArray[np.float32]


def steps_of(shot: Shot, config: SegmentationConfig, vocabulary: Vocabulary) -> PriorSteps | None:
    """Work out the prior of a matched frame; None if the template has no outline."""
    match, source = shot.match, shot.given.image
    assert match.body is not None
    shape = match.shape_prior.shape
    body = match.body.scaled(shape[1] / source.shape[1])
    window = window_about(body, None, shape)
    body = body.shifted(-window[1].start, -window[0].start)
    image, prior = shrink(source, (shape[0], shape[1]))[window], match.shape_prior[window]
    terms = shape_terms(
        prior,
        np.ascontiguousarray(cv2.cvtColor(image, cv2.COLOR_BGR2Lab)[:, :, 0]),
        body,
        vocabulary,
        **paper_parameters(config),
    )
    if terms is None:
        return None
    part = terms.part
    body = body.shifted(-part[1].start, -part[0].start)
    cap = float(terms.distance.max())
    return PriorSteps(
        terms,
        body,
        np.asarray(cv2.cvtColor(image[part], cv2.COLOR_BGR2RGB)),
        prior[part] > 127,
        terms.far[part],
        terms.psi[part],
        words_of(vocabulary, terms.points, body),
        word_distances(vocabulary, terms.points, terms.distance.shape, body, cap),
    )


def draw_prior(steps: PriorSteps, number: int, config: SegmentationConfig) -> Figure:
    """Draw how the prior is made of a template's outline and the image."""
    terms, points, height = steps.terms, steps.terms.points, steps.body.height
    words = len(steps.by_word)
    colours = word_colours(words)
    counts = np.bincount(steps.words, minlength=words)
    most = np.argsort(-counts, kind='stable')[:WORDS]
    figure = Figure(figsize=(10, 9), dpi=100, layout='constrained')
    panels: Any = figure.subfigures(2, 3, wspace=0.03, hspace=0.03)
    largest = float(terms.distance.max()) / height

    title = f'1  outline of the template,\nframe {number}, by its words'
    _, axes = _panel(panels[0, 0], title)
    axes.imshow((0.5 * steps.image + 110).astype(np.uint8))
    axes.scatter(points.columns, points.rows, s=7, color=colours[steps.words])
    dots = [_dot(colours[word], f'{word + 1}') for word in np.flatnonzero(counts)]
    right: Any = {'loc': 'center left', 'bbox_to_anchor': (1, 0.5)}
    axes.legend(handles=dots, title='word', handletextpad=0.1, **right)

    panel = panels[0, 1]
    panel.suptitle(f'2  distance to the points of one word,\nthe {len(most)} with most', size=11)
    small = panel.subplots(2, 2)
    for axes, word in zip(small.flat, most, strict=False):
        own = steps.words == word
        shown = axes.imshow(steps.by_word[word] / height, cmap=DISTANCES, vmin=0, vmax=largest)
        axes.scatter(points.columns[own], points.rows[own], s=2, color=colours[word])
        axes.set_title(f'word {word + 1}', fontsize=9)
    for axes in small.flat:
        axes.axis('off')
    panel.colorbar(shown, ax=small, label='body heights')

    title = '3  oriented distance: to the outline,\nmore at edges of another word'
    panel, axes = _panel(panels[0, 2], title)
    shown = axes.imshow(terms.distance / height, cmap=DISTANCES, vmin=0, vmax=largest)
    panel.colorbar(shown, ax=axes, label='body heights')

    title = '4  is there an edge of the image (grey)\nthat confirms it?'
    _, axes = _panel(panels[1, 0], title)
    ground = np.full((*steps.inside.shape, 3), 255, np.uint8)
    ground[steps.inside] = 225
    ground[terms.gradient.edges] = 110
    axes.imshow(ground)
    for flag, colour in ((True, 'tab:green'), (False, 'tab:red')):
        chosen = terms.confirmed == flag
        axes.scatter(points.columns[chosen], points.rows[chosen], s=7, color=colour)
    share = 100 * float(terms.confirmed.mean())
    dots = [
        _dot('tab:green', f'yes, {share:.0f} %'),
        _dot('tab:red', f'no: psi x {config.paper_edge_factor:g}'),
    ]
    below: Any = {'loc': 'upper center', 'bbox_to_anchor': (0.5, 0)}
    axes.legend(handles=dots, ncols=2, handletextpad=0.1, **below)

    title = '5  psi, after local search and 4:\nalong dark lines cuts are cheap'
    panel, axes = _panel(panels[1, 1], title)
    shown = axes.imshow(steps.psi, cmap='magma', vmin=0, vmax=1)
    full = f'1 = {config.paper_reach:g} body heights outside, {config.paper_depth:g} inside'
    panel.colorbar(shown, ax=axes, label=f'psi; {full}')

    reach = f'{config.paper_reach:g} body heights'
    _, axes = _panel(panels[1, 2], f'6  blue: beyond {reach},\nbackground in any case')
    left = steps.image.copy()
    left[steps.far] = (0.25 * left[steps.far] + 0.75 * np.array((90, 110, 160))).astype(np.uint8)
    axes.imshow(left)
    axes.contour(steps.inside, [0.5], colors='white', linewidths=1)
    axes.set_xlabel('white: outline of the template')
    return figure


def _panel(panel: SubFigure, title: str) -> tuple[SubFigure, Axes]:
    """Return a part of the figure and axes for one picture in it."""
    panel.suptitle(title, size=11)
    axes = panel.subplots()
    axes.set(xticks=[], yticks=[])
    return panel, axes


def _dot(colour: Any, label: str) -> Line2D:
    return Line2D([], [], marker='o', linestyle='', color=colour, label=label)

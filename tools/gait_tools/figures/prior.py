# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's shape prior of one frame, step by step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from gait_segmentation.geometry import BodyFrame
from gait_segmentation.images import shrink
from gait_segmentation.paper.prior import ShapeTerms, shape_terms, word_distances, words_of
from gait_segmentation.paper.vocabulary import Vocabulary
from gait_segmentation.segmentation import SegmentationConfig
from gait_segmentation.segmentation.segmenter import window_about
from gait_tools.figures.walk import Shot
from gait_tools.vocabulary_training import word_colours

WORDS = 4
"""Words whose distance transforms are shown."""


@dataclass(frozen=True)
class PriorSteps:
    """
    The prior of a frame.

    ``image`` is (h, w, 3) uint8 RGB, the part of the working image in which something is to be
    worked out, ``inside`` and ``far`` (h, w) bool, ``psi`` (h, w) float32; ``body`` is in the same
    pixels.  ``words`` (n,) are those of the outline points, ``by_word`` (K, h, w) float32 the
    distance transforms of their points, in pixels.
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
    """
    Work out the prior of a frame, also if the segmenter uses another one.

    :param shot: a frame with a match.
    :param config: whose ``paper_...`` parameters are used.
    :returns: the steps, None if the template has no outline.
    """
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
        reach=config.paper_reach,
        depth=config.paper_depth,
        orientation=config.paper_orientation,
        search=config.paper_search,
        unconfirmed=config.paper_edge_factor,
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
    """
    Draw how the prior is made of a template's outline and the image.

    :param number: of the frame.
    :param config: as of :func:`steps_of`.
    """
    terms, points, height = steps.terms, steps.terms.points, steps.body.height
    words = len(steps.by_word)
    colours = word_colours(words)[:, ::-1] / 255
    counts = np.bincount(steps.words, minlength=words)
    most = np.argsort(-counts, kind='stable')[:WORDS]
    names = [f'word{place}' for place in range(len(most))]
    figure = Figure(figsize=(11, 9), dpi=100, layout='constrained')
    grid = [
        ['outline', *names[:2], 'distance'],
        ['outline', *(names[2:] or names[:2]), 'distance'],
        ['edges', 'psi', 'psi', 'far'],
        ['edges', 'psi', 'psi', 'far'],
    ]
    axes: dict[str, Any] = figure.subplot_mosaic(grid, width_ratios=(2, 1, 1, 2.2))
    for each in axes.values():
        each.set(xticks=[], yticks=[])
    dim = (0.5 * steps.image + 110).astype(np.uint8)

    axes['outline'].imshow(dim)
    axes['outline'].scatter(points.columns, points.rows, s=7, color=colours[steps.words])
    axes['outline'].set_title(f'1  outline of the template in frame {number},\nby its words')
    used = np.flatnonzero(counts)
    axes['outline'].legend(
        handles=[_dot(colours[word], f'{word + 1}') for word in used],
        title='word', fontsize=8, loc='upper right', handletextpad=0.1, ncols=2, columnspacing=0.4,
    )  # fmt: skip

    largest = float(terms.distance.max()) / height
    for name, word in zip(names, most, strict=True):
        panel, own = axes[name], steps.words == word
        shown = panel.imshow(steps.by_word[word] / height, cmap='viridis_r', vmin=0, vmax=largest)
        panel.scatter(points.columns[own], points.rows[own], s=2, color=colours[word])
        panel.set_title(f'word {word + 1}: {counts[word]} points', fontsize=9)
    middle = [axes[name] for name in names]
    axes[names[0]].annotate(
        '2  distance to the points of one word', (1.05, 1.22), xycoords='axes fraction',
        ha='center', fontsize='large',
    )  # fmt: skip
    figure.colorbar(shown, ax=middle, location='bottom', label='body heights', shrink=0.9)

    shown = axes['distance'].imshow(
        terms.distance / height, cmap='viridis_r', vmin=0, vmax=largest
    )
    axes['distance'].set_title(
        '3  oriented distance: to the outline, and\nmore at image edges of another word'
    )
    figure.colorbar(shown, ax=axes['distance'], location='bottom', label='body heights')

    ground = np.full((*steps.inside.shape, 3), 255, np.uint8)
    ground[steps.inside] = 225
    ground[terms.gradient.edges] = 110
    axes['edges'].imshow(ground)
    for flag, colour in ((True, 'tab:green'), (False, 'tab:red')):
        chosen = terms.confirmed == flag
        axes['edges'].scatter(points.columns[chosen], points.rows[chosen], s=7, color=colour)
    axes['edges'].set_title('4  does an edge of the image (grey)\nconfirm the outline?')
    share = 100 * float(terms.confirmed.mean())
    axes['edges'].legend(
        handles=[
            _dot('tab:green', f'yes: {share:.0f} %'),
            _dot('tab:red', f'no: psi times {config.paper_edge_factor:g}'),
        ],
        loc='upper center', bbox_to_anchor=(0.5, 0), ncols=2, handletextpad=0.1, frameon=False,
    )  # fmt: skip

    shown = axes['psi'].imshow(steps.psi, cmap='magma', vmin=0, vmax=1)
    axes['psi'].set_title('5  psi: after local search and 4,\nwhere cuts are cheap (dark)')
    figure.colorbar(
        shown,
        ax=axes['psi'],
        location='bottom',
        label=f'cost of a cut; full at {config.paper_reach:g} body heights outside, '
        f'{config.paper_depth:g} inside',
    ).ax.xaxis.label.set_fontsize(8)

    left = steps.image.copy()
    left[steps.far] = (0.25 * left[steps.far] + 0.75 * np.array((90, 110, 160))).astype(np.uint8)
    axes['far'].imshow(left)
    axes['far'].contour(steps.inside, [0.5], colors='white', linewidths=1)
    axes['far'].set_title(
        f'6  farther than {config.paper_reach:g} body heights (blue):\n'
        'background, whatever the likelihood says'
    )
    axes['far'].set_xlabel('white: the template')
    return figure


def _dot(colour: Any, label: str) -> Line2D:
    return Line2D([], [], marker='o', linestyle='', color=colour, label=label)

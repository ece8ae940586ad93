# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Scores of a mask, a box and a gait phase against ground truth, as docs/evaluation.md says.

The *truth* of one person is (H, W) uint8: 255 the person, 0 background, anything else ambiguous.
*Labels* of several people are (H, W) uint8: 0 nobody, 1 to 16 one person each, anything else
ambiguous.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import Box
from gait_segmentation.images import Window
from gait_segmentation.people import MOST_PEOPLE

PERSON = 255  # value of the person in a mask
AMBIGUOUS = 170  # value this package writes for ambiguous pixels of a mask; others are, too
UNCLEAR = 255  # value this package writes for ambiguous pixels of labels
COLLAPSED = 0.5  # J below which a mask is no longer the person's
LOST_IOU = 0.2  # a frame whose box overlaps the true one less than this is lost
WINDOW = 1.5  # size of the evaluation window over that of the true box
WINDOW_ASPECT = 0.6  # least width of the evaluation window over the height of the true box
BOUNDARY_TOLERANCE = 0.008  # distance of boundaries that match, in diagonals of the image (DAVIS)
RIM_PX = 4  # width of the ambiguous rim about a person that belongs to the person's box


class BoxScore(NamedTuple):
    """IoU with the true box, and distance of the centres in its heights; NaN where undefined."""

    iou: float
    centre_error: float


@dataclass(frozen=True)
class FrameScore:
    """Scores in 0..1, errors in percent, and boxes: seen, whole body, refined, on the path."""

    j: float
    f: float
    error_rate: float
    error_rate_image: float
    visible: BoxScore
    tracked: BoxScore
    matched: BoxScore
    placed: BoxScore

    @property
    def lost(self) -> bool:
        """Return whether the truth shows somebody who is not in the visible box."""
        return self.visible.iou < LOST_IOU

    @property
    def collapsed(self) -> bool:
        """Return whether the mask is no longer the person's."""
        return self.j < COLLAPSED


def truth_of(labels: NDArray[np.uint8], person: int) -> NDArray[np.uint8]:
    """Return the truth of one person of some labels; other people are background."""
    table = np.zeros(256, np.uint8)
    table[MOST_PEOPLE + 1 :] = AMBIGUOUS
    table[person] = PERSON
    return table[labels]


def labels_of_truth(truth: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the labels of a truth with one person, who is 1."""
    table = np.full(256, UNCLEAR, np.uint8)
    table[0], table[PERSON] = 0, 1
    return table[truth]


def true_box(truth: NDArray[np.uint8]) -> Box | None:
    """Return the tight box of the person's pixels, None if there are none."""
    return Box.around(truth == PERSON)


def start_box(truth: NDArray[np.uint8]) -> Box | None:
    """Return the box a user would draw: tight about the person with the ambiguous rim."""
    person = (truth == PERSON).astype(np.uint8)
    near = cv2.dilate(person, np.ones((2 * RIM_PX + 1, 2 * RIM_PX + 1), np.uint8))
    return Box.around((near > 0) & (truth != 0))


def window_about(box: Box, shape: tuple[int, ...]) -> Window:
    """Return the rows and columns that are scored about a true box in an image of a shape."""
    height, width = shape
    window_width = max(WINDOW * box.width, WINDOW_ASPECT * box.height)
    window = Box.from_center(box.center_x, box.center_y, window_width, WINDOW * box.height)
    return (
        slice(max(round(window.y), 0), min(round(window.bottom), height)),
        slice(max(round(window.x), 0), min(round(window.right), width)),
    )


def evaluation_window(truth: NDArray[np.uint8]) -> Window:
    """Return the rows and columns that are scored; all of them if the truth shows nobody."""
    box = true_box(truth)
    if box is None:
        return slice(0, truth.shape[0]), slice(0, truth.shape[1])
    return window_about(box, truth.shape)


def centre_distance(box: Box, expected: Box) -> float:
    """Return how far apart the centres are, in heights of the expected box."""
    dx, dy = box.center_x - expected.center_x, box.center_y - expected.center_y
    return math.hypot(dx, dy) / expected.height


def _count(inside: NDArray[Any]) -> int:
    # NumPy's own count is an integer of its own that JSON does not know.
    return int(np.count_nonzero(inside))


def jaccard(mask: NDArray[np.uint8], truth: NDArray[np.uint8]) -> float:
    """Return intersection over union off the ambiguous pixels, 1 if both are empty."""
    person = truth == PERSON
    found = (mask > 0) & (person | (truth == 0))
    union = _count(found | person)
    return _count(found & person) / union if union else 1.0


def error_percent(mask: NDArray[np.uint8], truth: NDArray[np.uint8]) -> float:
    """Return the missegmented pixels in percent of those that are not ambiguous."""
    person = truth == PERSON
    known = person | (truth == 0)
    wrong = _count(((mask > 0) != person) & known)
    return 100 * wrong / max(_count(known), 1)


def boundary_f(
    mask: NDArray[np.uint8], truth: NDArray[np.uint8], tolerance: int | None = None
) -> float:
    """Return the boundary measure F of DAVIS (Perazzi et al., CVPR 2016) on the whole image."""
    if tolerance is None:
        tolerance = math.ceil(BOUNDARY_TOLERANCE * math.hypot(*truth.shape))
    ambiguous = (truth != PERSON) & (truth != 0)
    found = _boundary((mask > 0) & ~ambiguous)
    true = _boundary(truth == PERSON)
    n_found, n_true = _count(found), _count(true)
    if n_found == 0 or n_true == 0:
        return 1.0 if n_found == n_true else 0.0
    rows, columns = np.mgrid[-tolerance : tolerance + 1, -tolerance : tolerance + 1]
    disk = (rows**2 + columns**2 <= tolerance**2).astype(np.uint8)
    precision = _count(found & cv2.dilate(true, disk)) / n_found
    recall = _count(true & cv2.dilate(found, disk)) / n_true
    total = precision + recall
    return 2 * precision * recall / total if total > 0 else 0.0


def _boundary(inside: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """Mark the pixels that differ from their right, lower or lower right neighbour."""
    padded = np.pad(inside, ((0, 1), (0, 1)), mode='edge')
    east, south, diagonal = padded[:-1, 1:], padded[1:, :-1], padded[1:, 1:]
    return ((inside ^ east) | (inside ^ south) | (inside ^ diagonal)).astype(np.uint8)


def score_box(box: Box | None, expected: Box | None) -> BoxScore:
    """Compare a box with the true one."""
    if expected is None:
        return BoxScore(math.nan, math.nan)
    if box is None:
        return BoxScore(0.0, math.nan)
    return BoxScore(float(box.iou(expected)), centre_distance(box, expected))


def score_frame(
    mask: NDArray[np.uint8],
    box: Box | None,
    truth: NDArray[np.uint8],
    body: Box | None = None,
    matched: Box | None = None,
    placed: Box | None = None,
) -> FrameScore:
    """Score a mask, the visible box, that of the whole body, the refined and the placed one."""
    window, expected, size = evaluation_window(truth), true_box(truth), truth.shape[1::-1]
    return FrameScore(
        j=jaccard(mask[window], truth[window]),
        f=boundary_f(mask, truth),
        error_rate=error_percent(mask[window], truth[window]),
        error_rate_image=error_percent(mask, truth),
        visible=score_box(box, expected),
        tracked=score_box(body and body.clipped(*size), expected),
        matched=score_box(matched and matched.clipped(*size), expected),
        placed=score_box(placed and placed.clipped(*size), expected),
    )


def mean_known(values: Iterable[float | None]) -> float | None:
    """Return the mean of the values that are neither None nor NaN, None without any."""
    known = [value for value in values if value is not None and not math.isnan(value)]
    return statistics.fmean(known) if known else None

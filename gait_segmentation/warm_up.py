# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Running the stages once before the first frame comes.

Numba compiles a kernel, or loads it from its cache, when it is first called; that takes up to
seconds and must not happen while a camera waits.

A node has one stage, and what the others need takes long to import: each is imported when it is
warmed up.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import BodyFrame, Box
from gait_segmentation.results import Feedback, MatchResult

if TYPE_CHECKING:
    from gait_segmentation.gait_model import TemplateBank
    from gait_segmentation.matching import MatchingConfig
    from gait_segmentation.pipeline import PipelineConfig
    from gait_segmentation.segmentation import SegmentationConfig
    from gait_segmentation.starting import StartingConfig
    from gait_segmentation.tracking import TrackingConfig

__all__ = ['open_bank', 'warm_up', 'warm_up_matcher', 'warm_up_segmenter', 'warm_up_tracker']

_WIDTH, _HEIGHT, _BODY = 200, 180, 80
_FRAMES = 7
_STEP_NS = 33_000_000


def open_bank(path: str) -> TemplateBank:
    """
    Return the bank of a file, the standard one for an empty path.

    :raises BankError: if it cannot be read.
    """
    from gait_segmentation.gait_model import TemplateBank, default_bank

    return TemplateBank.load(path) if path else default_bank()


def warm_up(config: PipelineConfig, bank: TemplateBank | None = None) -> None:
    """
    Call everything that a pipeline calls in its first frames.

    :param bank: the templates; the standard bank if None.
    """
    bank = bank if bank is not None else open_bank('')
    warm_up_tracker(bank, config.tracking, config.starting)
    warm_up_matcher(bank, config.matching)
    warm_up_segmenter(config.segmentation)


def warm_up_tracker(
    bank: TemplateBank, config: TrackingConfig, starting: StartingConfig | None = None
) -> None:
    """
    Call everything that the tracking stage calls in its first frames.

    :param starting: how people are found; as by default if None.
    """
    from gait_segmentation.starting import StartingConfig, WalkerFinder
    from gait_segmentation.tracking import PeopleTracker
    from gait_segmentation.tracking.background import BackgroundModel
    from gait_segmentation.tracking.cues import add_motion
    from gait_segmentation.tracking.learning import without_world
    from gait_segmentation.tracking.spreading import spread_evidence

    finder = WalkerFinder(bank, starting)
    for index in range(_FRAMES):
        finder.update(_scene(index)[0], (index + 1) * _STEP_NS)
    tracker = PeopleTracker(bank, config, starting=StartingConfig(auto_init='off'))
    for index in range(_FRAMES):
        image, mask, body = _scene(index)
        box = Box.around(mask)
        if index == 0 and box is not None:
            tracker.initialize(box)
        (track,) = tracker.update(image, (index + 1) * _STEP_NS)
        size = track.likelihood.shape[::-1]
        prior = np.asarray(cv2.resize(mask, size, interpolation=cv2.INTER_AREA))
        tracker.learn([Feedback(track.stamp_ns, track.track_id, mask, body, prior)])
    # What only a camera or a body calls whose motion is known, which noise does not tell.
    part, still = (slice(0, 8), slice(0, 8)), np.eye(2, 3)
    gray, shift = np.zeros((8, 8), np.uint8), np.array([[1.0, 0.0, 0.5], [0.0, 1.0, 0.5]])
    add_motion(np.zeros(gray.shape, np.float32), gray, gray, still, shift, part, 1.0)
    model = BackgroundModel((16, 16))
    model.move(still)
    model.move(np.array([[0.9, -0.1, 0.0], [0.1, 0.9, 0.0]]))
    model.slopes(part)
    moving, lab = np.full(gray.shape, -1, np.float32), np.zeros((*gray.shape, 3), np.uint8)
    spread_evidence(lab, model.sums, part, 2.5, moving, gray, 80.0, 0.5)
    blob = np.pad(np.full((6, 6), 255, np.uint8), 5)
    about = (slice(2, 14), slice(2, 14)), np.full((12, 12), -1, np.float32)
    for settled in (False, True):
        without_world(blob, blob, about, 80.0, settled=settled)


def warm_up_matcher(bank: TemplateBank, config: MatchingConfig) -> None:
    """Call everything that the matching stage calls in its first frames."""
    from gait_segmentation.matching import SequenceMatcher

    matcher = SequenceMatcher(bank, config)
    for index in range(_FRAMES):
        _, mask, _ = _scene(index)
        box = Box.around(mask)
        # Once the box jumps, and once something hides a part of the figure.
        known = np.where(mask[::-1] > 0, 0, 255).astype(np.uint8)
        matcher.update(
            mask,
            box.shifted(_BODY / 4, 0) if index == 3 and box is not None else box,
            (index + 1) * _STEP_NS,
            track_id=1,
            source_size=(_WIDTH, _HEIGHT),
            known=known if index == 4 else None,
        )
    matcher.flush()


def warm_up_segmenter(config: SegmentationConfig) -> None:
    """Call everything that the segmentation stage calls in its first frames."""
    from gait_segmentation.segmentation import Segmenter

    segmenter = Segmenter(config)
    for index in range(_FRAMES):
        image, mask, body = _scene(index)
        # Half the size, so that the outline is refined at full resolution as well.
        small = np.asarray(cv2.resize(mask, (_WIDTH // 2, _HEIGHT // 2)))
        likelihood = cv2.blur(small, (5, 5))
        stamp = (index + 1) * _STEP_NS
        match = MatchResult(stamp, 1, body, None, 0, index, index / 20, 1.0, 0.0, 1.0, 1.0, small)
        segmenter.update(image, likelihood, match)


def _scene(index: int) -> tuple[NDArray[np.uint8], NDArray[np.uint8], BodyFrame]:
    """Return image, mask and body of a figure that leaves a noisy image on the right."""
    rng = np.random.default_rng(index)
    image = rng.integers(60, 120, (_HEIGHT, _WIDTH, 3)).astype(np.uint8)
    body = BodyFrame(90.0 + 15 * index, _HEIGHT / 2, _BODY)
    mask = np.zeros((_HEIGHT, _WIDTH), np.uint8)
    center = (round(body.center_x), round(body.center_y))
    cv2.ellipse(mask, center, (_BODY // 7, _BODY // 2), 0, 0, 360, 255, -1)
    image[mask > 0] = (40, 40, 200)
    return image, mask, body

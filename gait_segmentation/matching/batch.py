# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Matching of a whole clip at once."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.geometry import Box
from gait_segmentation.matching.config import MatchingConfig
from gait_segmentation.matching.matcher import SequenceMatcher
from gait_segmentation.results import MatchResult

__all__ = ['LONGEST_LAG', 'ClipFrame', 'match_clip']

LONGEST_LAG = 300
"""Frames a decision may wait for; longer clips are decided with this lag."""


@dataclass(frozen=True)
class ClipFrame:
    """One frame of a clip, as :meth:`SequenceMatcher.update` takes it."""

    likelihood: NDArray[np.uint8]
    box: Box | None
    stamp_ns: int
    known: NDArray[np.uint8] | None = None


def match_clip(
    bank: TemplateBank,
    frames: Sequence[ClipFrame],
    source_size: tuple[int, int],
    config: MatchingConfig | None = None,
) -> list[MatchResult]:
    """
    Match a clip offline: every frame is decided by all frames of its path.

    Needs the scores of all frames at once, 0.4 MB a frame with the standard bank.

    :param frames: the frames in the order of their stamps.
    :param source_size: (width, height) of the source image.
    :param config: parameters, of which ``lag`` is not used; the defaults if None.
    :returns: one result a frame, in the same order.
    :raises InputError: if a frame cannot be used.
    """
    lag = min(len(frames), LONGEST_LAG)
    matcher = SequenceMatcher(bank, dataclasses.replace(config or MatchingConfig(), lag=lag))
    results: list[MatchResult] = []
    for frame in frames:
        results += matcher.update(
            frame.likelihood,
            frame.box,
            frame.stamp_ns,
            track_id=1,
            source_size=source_size,
            known=frame.known,
        )
    return results + matcher.flush()

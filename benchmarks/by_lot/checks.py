# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What must hold of everything that comes out."""

from __future__ import annotations

import math
from dataclasses import fields

import numpy as np

from gait_segmentation.geometry import BodyFrame
from gait_segmentation.pipeline import FrameResult
from gait_segmentation.results import EMPTY, MatchResult, SegmentationResult, TrackResult

__all__ = ['check_frame', 'check_person']


def check_person(
    track: TrackResult, match: MatchResult, found: SegmentationResult, shape: tuple[int, int]
) -> None:
    assert track.stamp_ns == match.stamp_ns == found.stamp_ns, 'one frame'
    assert track.track_id == match.track_id == found.track_id, 'one person'
    assert (track.state == EMPTY) == (track.track_id == 0), 'state'
    assert (track.likelihood.dtype, track.likelihood.ndim) == (np.uint8, 2), 'likelihood'
    assert match.shape_prior.shape == track.likelihood.shape, 'shape prior'
    assert match.shape_prior.dtype == np.uint8, 'shape prior'
    assert (found.mask.shape, found.mask.dtype) == (shape, np.uint8), 'mask'
    assert bool(found.mask.any()) == (found.reason == ''), f'reason {found.reason!r}'
    numbers = [track.confidence, match.confidence, match.similarity, match.phase]
    assert all(0 <= value <= 1 for value in numbers), f'0 to 1: {numbers}'
    assert match.phase < 1, 'phase'
    others = [track.angle, match.azimuth, match.phase_rate]
    others += [value for each in track.features for value in (each.variance_ratio, each.weight)]
    others += [getattr(match.body, each.name) for each in fields(BodyFrame)] if match.body else []
    assert all(map(math.isfinite, others)), f'finite: {others}'


def check_frame(result: FrameResult, image_shape: tuple[int, int], slots: int) -> None:
    assert len(result.people) == slots, 'one result a slot'
    labels, mask = result.labels, result.mask
    assert labels.shape == mask.shape == image_shape, 'size'
    assert labels.dtype == mask.dtype == np.uint8, 'type'
    assert np.isin(np.unique(mask), (0, 255)).all(), '0 or 255'
    assert labels.max() <= slots, 'labels'
    assert ((labels > 0) == (mask > 0)).all(), 'labels'
    for slot, person in enumerate(result.people):
        check_person(person.track, person.match, person.segmentation, image_shape)
        assert ((person.segmentation.mask > 0) == (labels == slot + 1)).all(), 'owners'
    ids = [person.track.track_id for person in result.people if person.track.track_id]
    assert len(set(ids)) == len(ids), 'track ids'

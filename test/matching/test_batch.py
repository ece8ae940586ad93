# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np

from gait_segmentation.matching import ClipFrame, MatchingConfig, match_clip
from test.matching.test_matcher import SIZE, bank, off, walk

__all__ = ['bank']


def test_every_frame_is_decided_by_all(bank):
    rng = np.random.default_rng(0)
    frames = list(walk(0.0, 15))
    noise = rng.integers(0, 256, frames[0][2].shape).astype(np.uint8)
    clip = [ClipFrame(image, box, stamp) for stamp, _, image, box in frames]
    clip[0] = ClipFrame(noise, clip[0].box, clip[0].stamp_ns)
    config = MatchingConfig(shifts_x=3, shifts_y=2, scales=1)
    results = match_clip(bank, clip, SIZE, config)
    assert [r.stamp_ns for r in results] == [f[0] for f in frames]
    assert np.abs(off(results, frames, 0.0)).max() < 0.08
    assert match_clip(bank, [], SIZE, config) == []

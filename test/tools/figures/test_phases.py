# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import math

import numpy as np
import pytest

from gait_segmentation.matching import MatchingConfig
from gait_tools.figures.phases import Phases, draw_phases, phases_of
from test.walkers import small_bank

from .shots import short

TRUE = np.arange(10) / 20


def made(path: np.ndarray, true: np.ndarray = TRUE) -> Phases:
    return Phases(np.arange(len(path)), path, path, true)


def test_half_a_stride_may_be_off_for_the_whole_clip_but_not_for_some_frames():
    off = made((TRUE + 0.5) % 1)
    assert off.rms(off.path) == pytest.approx(0, abs=1e-9)
    assert np.allclose(off.shown_truth(), (TRUE + 0.5) % 1)
    half = (TRUE + np.where(np.arange(10) < 5, 0.5, 0)) % 1
    assert made(half).rms(half) > 30


def test_steps_back_are_counted_and_the_turn_of_the_stride_is_none():
    path = np.array([0.9, 0.95, 0.05, 0.0, 0.1])
    assert made(path, TRUE[:5]).backward(path) == 25
    assert made(path, TRUE[:5]).backward(path[:1]) == 0


def test_without_truth_there_is_no_error():
    phases = made(TRUE, np.full(10, np.nan))
    assert math.isnan(phases.rms(phases.path))
    assert draw_phases(phases).any()


def test_the_path_is_matched_and_each_frame_alone():
    phases = phases_of(short(), small_bank(), MatchingConfig())
    assert list(phases.numbers) == list(range(8))
    assert np.isfinite(phases.alone).all()
    assert phases.rms(phases.path) < 10
    assert (draw_phases(phases) != 255).any()

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.errors import InputError
from gait_segmentation.geometry import BodyFrame, Box
from gait_segmentation.segmentation.inputs import (
    check_sizes,
    in_window,
    no_finer,
    source_window,
    window_about,
    without,
)

IMAGE = np.zeros((60, 80, 3), np.uint8)


def grey(height: int, width: int) -> np.ndarray:
    return np.zeros((height, width), np.uint8)


def test_sizes_that_fit_pass() -> None:
    check_sizes(IMAGE, grey(60, 80), grey(60, 80))
    check_sizes(IMAGE, grey(30, 40), grey(30, 40))


@pytest.mark.parametrize(
    ('likelihood', 'prior', 'message'),
    [
        (grey(30, 40).astype(float), grey(30, 40), 'likelihood must be .*float64'),
        (grey(30, 40), np.zeros((30, 40, 1), np.uint8), 'shape prior must be'),
        (grey(30, 40), grey(30, 41), 'must have the same size'),
        (grey(30, 30), grey(30, 30), 'proportions'),
        (grey(120, 160), grey(120, 160), 'no larger'),
    ],
)
def test_others_are_refused(likelihood: np.ndarray, prior: np.ndarray, message: str) -> None:
    with pytest.raises(InputError, match=message):
        check_sizes(IMAGE, likelihood, prior)


def test_the_window_holds_what_was_found_before_if_it_is_near() -> None:
    body = BodyFrame(50.0, 50.0, 40.0, 0.0)
    rows, columns = window_about(body, None, (100, 100))
    assert rows.start < 30 < 70 < rows.stop
    reaching = Box(55, 40, 44, 20)
    assert window_about(body, reaching, (100, 100))[1].stop > max(columns.stop, 99)
    assert window_about(body, Box(0, 0, 3, 3), (100, 100)) == (rows, columns)
    outside = window_about(BodyFrame(500.0, 50.0, 40.0, 0.0), None, (100, 100))
    assert outside[1].start >= outside[1].stop


def test_a_body_in_a_window_keeps_its_place() -> None:
    body = in_window(BodyFrame(50.0, 40.0, 30.0, 0.2), (slice(10, 90), slice(20, 90)))
    assert body == BodyFrame(30.0, 30.0, 30.0, 0.2)


def test_a_working_window_covers_its_part_of_the_source() -> None:
    window = (slice(5, 20), slice(0, 33))
    assert source_window(window, 0.5, (60, 65)) == (slice(10, 40), slice(0, 65))


def test_pixels_that_are_taken_are_nobodys() -> None:
    likelihood = np.full((10, 10), 200, np.uint8)
    taken = grey(8, 12)
    taken[:, 6:] = 255
    out = without(likelihood, (slice(2, 6), slice(1, 7)), taken)
    assert (likelihood == 200).all()
    assert (out[2:6, 4:7] == 0).all()
    assert np.count_nonzero(out == 0) == 12


def test_a_body_is_cut_out_no_finer_than_it_need_be() -> None:
    maps = np.zeros((4000, 400), np.uint8), np.full((4000, 400), 255, np.uint8)
    usual = BodyFrame(200.0, 200.0, 300.0)
    assert all(a is b for a, b in zip(no_finer(*maps, usual, 400), maps, strict=True))
    # Half the size of the image, and a body as tall as that allows.
    tall = BodyFrame(400.0, 4000.0, 7800.0)
    likelihood, prior = no_finer(*maps, tall, 800)
    assert likelihood.shape == prior.shape
    assert likelihood.size <= 1.1 * 2**18
    assert likelihood.shape[0] == pytest.approx(10 * likelihood.shape[1], rel=0.01)
    assert (prior == 255).all()

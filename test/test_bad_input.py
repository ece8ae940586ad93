# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Nothing that a camera or another node may send stops the stream: a mask, or none and why."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
import pytest

from gait_segmentation.detector.networks import DetectorConfig
from gait_segmentation.errors import InputError
from gait_segmentation.geometry import Box
from gait_segmentation.pipeline import FrameResult, Pipeline, PipelineConfig
from test.walkers import box_of, clip, small_bank

FRAMES = 4


def film() -> list[np.ndarray]:
    return [frame.image for frame in clip()[:FRAMES]]


def play(
    images: Sequence[np.ndarray], box: Box, heat_map: np.ndarray | None = None
) -> list[FrameResult]:
    """Run a pipeline and check what holds of every result."""
    pipe = Pipeline(bank=small_bank())
    pipe.initialize(box)
    results = []
    for number, image in enumerate(images):
        [result] = pipe.update(image, 10**9 + number * 33_000_000, heat_map)
        found = result.people[0].segmentation
        assert found.mask.shape == image.shape[:2]
        assert set(np.unique(found.mask)) <= {0, 255}
        assert found.mask.any() == (found.reason == '')
        results.append(result)
    return results


@pytest.mark.parametrize('shape', [(240, 320), (1, 1)])
@pytest.mark.parametrize('value', [0, 255])
def test_a_heat_map_that_says_the_same_everywhere(value: int, shape: tuple[int, int]) -> None:
    results = play(film(), box_of(clip()[0]), np.full(shape, value, np.uint8))
    assert all(result.mask.any() for result in results)


@pytest.mark.parametrize('shape', [(240, 320), (1, 1), (300, 1)])
@pytest.mark.parametrize('value', [0, 255])
def test_constant_images_also_of_a_pixel_or_a_line(value: int, shape: tuple[int, int]) -> None:
    box = box_of(clip()[0]) if shape == (240, 320) else Box(0, 0, shape[1], shape[0])
    play([np.full((*shape, 3), value, np.uint8)] * FRAMES, box)


@pytest.mark.parametrize(
    'box',
    [
        Box(100, 80, 1, 8),
        Box(50, 100, 200, 8),
        Box(296, 216, 47, 47),
        Box(-4, -4, 8.1, 8.1),
        Box(-400, -400, 1280, 960),
    ],
    ids=str,
)
def test_boxes_that_hold_no_person(box: Box) -> None:
    play(film(), box)


@pytest.mark.parametrize(
    'box',
    [
        Box(320, 0, 9, 9),
        Box(0.4, 0.3, 0.1, 0.5),
        Box(-400, -800, 800, 2000),
        Box(-5e5, -5e5, 1e6, 1e6),
    ],
    ids=str,
)
def test_boxes_that_cannot_hold_a_person_are_refused_and_the_stream_goes_on(box: Box) -> None:
    config = PipelineConfig(detector=DetectorConfig(network='none'))
    pipe = Pipeline(config, small_bank())
    pipe.initialize(box)
    [image, *_] = film()
    with pytest.raises(InputError, match=r'of 320 x 240 pixels.*, got x'):
        pipe.update(image, 10**9)
    [result] = pipe.update(image, 10**9)
    assert not result.mask.any()


@pytest.mark.parametrize('height', [20, 2000])
def test_a_person_of_any_size(height: int) -> None:
    box = box_of(clip()[0])
    scale = height / box.height
    # The part of the image about the walker, as the whole of it could be 5000 pixels wide.
    left, top = max(round(box.x) - 20, 0), max(round(box.y) - 5, 0)
    part = np.s_[top : top + 125, left : left + 100] if scale > 1 else np.s_[:, :]
    how = cv2.INTER_LINEAR if scale > 1 else cv2.INTER_AREA
    images = [
        cv2.resize(image[part], None, fx=scale, fy=scale, interpolation=how)
        for image in film()[: 2 if scale > 1 else None]
    ]
    shifted = box.shifted(-left, -top) if scale > 1 else box
    assert all(result.mask.any() for result in play(images, shifted.scaled(scale)))

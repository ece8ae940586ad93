# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""After the warm-up nothing is compiled any more, whatever the first frames show."""

from __future__ import annotations

import importlib
import pkgutil
from pathlib import Path

import cv2
import numpy as np
import pytest
from numba.core.dispatcher import Dispatcher
from numpy.typing import NDArray

import gait_segmentation
from gait_segmentation.errors import BankError
from gait_segmentation.geometry import Box
from gait_segmentation.people import PeopleConfig
from gait_segmentation.pipeline import Pipeline, PipelineConfig
from gait_segmentation.warm_up import open_bank, warm_up
from test.walkers import box_of, clip, couple, small_bank, sunlit

NOT_OF_A_STAGE = ('cli', 'commands', 'evaluation', 'nodes', 'ros')
FRAMES = 14

Play = tuple[list[NDArray[np.uint8]], list[Box]]


@pytest.fixture(scope='module')
def kernels() -> dict[str, Dispatcher]:
    """Return every kernel of the stages by name."""
    found = {}
    names = [
        each.name
        for each in pkgutil.walk_packages(gait_segmentation.__path__, 'gait_segmentation.')
        if each.name.split('.')[1] not in NOT_OF_A_STAGE
    ]
    for name in names:
        for key, value in vars(importlib.import_module(name)).items():
            if isinstance(value, Dispatcher) and value.py_func.__module__ == name:
                found[f'{name}.{key}'] = value
    return found


def panned() -> Play:
    frames = clip(frames=FRAMES)
    return [frame.image for frame in frames], [box_of(frames[0])]


def narrow() -> Play:
    """Return a film in which the surroundings of the person are all of the image."""
    frames = clip(frames=FRAMES)
    images, boxes = [], []
    for frame in frames:
        box = box_of(frame)
        left = round(box.center_x) - 32
        images.append(np.ascontiguousarray(frame.image[:, left : left + 64]))
        boxes.append(box.shifted(-left, 0.0))
    return images, boxes[:1]


def turning() -> Play:
    images, boxes = panned()
    size = images[0].shape[1::-1]
    turns = [cv2.getRotationMatrix2D((160, 120), 2.0 * k, 1.0) for k in range(len(images))]
    turned = [
        np.asarray(cv2.warpAffine(image, turn, size, borderMode=cv2.BORDER_REFLECT))
        for image, turn in zip(images, turns, strict=True)
    ]
    return turned, boxes


def grey() -> Play:
    images, boxes = panned()
    mean = [image.mean(2, keepdims=True).astype(np.uint8) for image in images]
    return [np.repeat(each, 3, 2) for each in mean], boxes


def leaving() -> Play:
    """Return a film whose person is suddenly gone and comes back."""
    images, boxes = panned()
    return [*images[:5], *([images[0][:, ::-1].copy()] * 6), *images[5:9]], boxes


def two() -> Play:
    frames = couple()
    return [frame.image for frame in frames], [box_of(frames[0], number) for number in (0, 1)]


def two_close() -> Play:
    images, boxes = two()
    small = [np.asarray(cv2.resize(image, None, fx=0.4, fy=1.0)) for image in images]
    return small, [Box(0.4 * b.x, b.y, 0.4 * b.width, b.height) for b in boxes]


def unannounced() -> Play:
    return [frame.image for frame in clip(frames=40)], []


def sunny() -> Play:
    frames = sunlit()
    return [frame.image for frame in frames], [box_of(frames[0])]


def test_nothing_is_compiled_or_loaded_while_people_walk(kernels: dict[str, Dispatcher]) -> None:
    config = PipelineConfig(people=PeopleConfig(max_people=2))
    warm_up(config, small_bank())
    before = {name: set(kernel.signatures) for name, kernel in kernels.items()}
    for play in (panned, narrow, turning, grey, leaving, two, two_close, unannounced, sunny):
        pipeline = Pipeline(config, small_bank())
        images, boxes = play()
        for box in boxes:
            pipeline.initialize(box)
        results = []
        for number, image in enumerate(images):
            results += pipeline.update(image, (number + 1) * 33_000_000)
        assert any(result.labels.any() for result in results), play.__name__
        new = [name for name, kernel in kernels.items() if set(kernel.signatures) - before[name]]
        assert not new, play.__name__


def test_a_bank_file_is_opened(tmp_path: Path) -> None:
    small_bank().save(tmp_path / 'bank.npz')
    assert open_bank(str(tmp_path / 'bank.npz')).templates.shape == small_bank().templates.shape
    with pytest.raises(BankError):
        open_bank(str(tmp_path / 'missing.npz'))

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What is declared is compiled, and then nothing else is, whatever the first frames show."""

from __future__ import annotations

import importlib
import pkgutil
import re
import subprocess
import sys
import threading
from dataclasses import replace

import cv2
import numpy as np
import pytest
from numba.core.caching import FunctionCache
from numba.core.dispatcher import Dispatcher
from numpy.typing import NDArray

import gait_segmentation
from gait_segmentation.detector.networks import DetectorConfig
from gait_segmentation.geometry import Box
from gait_segmentation.kernels import compile_kernels, compiling, kernel
from gait_segmentation.matching import MatchingConfig
from gait_segmentation.people import PeopleConfig
from gait_segmentation.pipeline import Pipeline, PipelineConfig
from gait_segmentation.segmentation import SegmentationConfig
from gait_tools.gait_model import BankSpec, build_bank
from test.walkers import box_of, clip, couple, sunlit

NOT_OF_A_STAGE = ('cli', 'nodes', 'ros')
FRAMES = 10

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
    return panned()[0], []


def sunny() -> Play:
    frames = sunlit(FRAMES)
    return [frame.image for frame in frames], [box_of(frames[0])]


def test_nothing_is_compiled_or_loaded_while_people_walk(kernels: dict[str, Dispatcher]) -> None:
    config = PipelineConfig(people=PeopleConfig(max_people=2))
    # Who is drawn by a network, which takes longest, is learnt in the same way.
    boxes = replace(config, detector=DetectorConfig(network='boxes'))
    # Of two builds, between which is chosen.
    bank = build_bank(BankSpec(azimuths=4, phases=8, builds='average,dress'))
    compile_kernels()
    before = {name: set(kernel.signatures) for name, kernel in kernels.items()}
    paper = PipelineConfig(
        matching=MatchingConfig(kernel='direct_access_table'),
        segmentation=SegmentationConfig(prior='paper'),
        detector=boxes.detector,
    )
    drawn, others = (panned, two, unannounced), (narrow, turning, grey, leaving, two_close, sunny)
    plays = [(each, config) for each in drawn] + [(each, boxes) for each in others]
    for play, chosen in (*plays, (panned, paper)):
        pipeline = Pipeline(chosen, bank)
        images, boxes = play()
        for box in boxes:
            pipeline.initialize(box)
        results = []
        for number, image in enumerate(images):
            results += pipeline.update(image, (number + 1) * 33_000_000)
        assert any(result.labels.any() for result in results), play.__name__
        new = [name for name, kernel in kernels.items() if set(kernel.signatures) - before[name]]
        assert not new, play.__name__


def test_a_stage_has_its_kernels_from_its_import_on(kernels: dict[str, Dispatcher]) -> None:
    """Else those that are imported with the first frame would be compiled then."""
    script = 'import sys, gait_segmentation.pipeline; print(*sys.modules)'
    done = subprocess.run([sys.executable, '-c', script], capture_output=True, text=True)
    assert kernels
    assert {name.rpartition('.')[0] for name in kernels} <= {*done.stdout.split()}, done.stderr


@kernel('i8, UniTuple(i8, 2)', 'f8, UniTuple(i8, 2)')
def called(number: float, more: tuple[int, int]) -> float:
    return number + more[0]


def test_kernels_are_compiled_as_they_are_declared() -> None:
    compile_kernels('gait_segmentation', 'test.test_kernel')
    assert not called.signatures
    compile_kernels(__name__)
    assert len(called.signatures) == 2
    assert (called(1, (2, 3)), called(1.0, (2, 3))) == (3, 3.0)
    assert len(called.signatures) == 2
    assert compile_kernels(__name__) == 0


def test_what_takes_long_is_said_and_a_full_disk_is_that_of_the_cache(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    said, waited = [], threading.Semaphore(0)
    compile_kernels(__name__)
    monkeypatch.setattr('gait_segmentation.kernels._EVERY_S', 0.01)
    with compiling(lambda text: (said.append(text), waited.release()), patience_s=0.0):
        assert all(waited.acquire(timeout=60) for _ in range(3))
    assert 'once after an installation' in said[0]
    # The last of as many as there were.
    assert re.fullmatch(r'still at the kernels: (\d+) of \1, \w+', said[2])
    said.clear()
    with pytest.raises(OSError) as caught, compiling(said.append, patience_s=3600.0):
        raise OSError(28, 'full')
    assert caught.value.filename == 'the cache of compiled kernels'
    assert said == []


def test_without_a_folder_that_can_be_written_kernels_are_compiled_and_that_is_said(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(FunctionCache._impl_class, '_locator_classes', [])

    @kernel()
    def made_up(number: int) -> int:
        return number + 1

    assert made_up(1) == 2
    (said,) = caplog.messages
    assert 'set NUMBA_CACHE_DIR' in said

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The examples in Python, as they stand in the documents."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from test.walkers import clip

ROOT = Path(__file__).parents[1]
FRAMES = 6


def example(document: str) -> str:
    (code,) = re.findall(r'```python\n(.*?)```', (ROOT / document).read_text(), re.DOTALL)
    return str(code)


def images() -> list[np.ndarray]:
    return [frame.image for frame in clip()[:FRAMES]]


def test_the_example_of_the_readme_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    height, width = images()[0].shape[:2]
    film = cv2.VideoWriter(
        str(tmp_path / 'walk.mp4'), cv2.VideoWriter.fourcc(*'mp4v'), 30, (width, height)
    )
    for image in images():
        film.write(image)
    film.release()
    monkeypatch.chdir(tmp_path)
    found: dict[str, Any] = {}
    exec(example('README.md'), found)
    assert found['frame'].mask.shape == (height, width)
    assert found['frame'].stamp_ns == FRAMES * 10**9 // 30


def test_the_example_of_the_library_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    class Camera:
        def __init__(self, number: int) -> None:
            self._images = iter(images())

        def read(self) -> tuple[bool, np.ndarray | None]:
            image = next(self._images, None)
            return image is not None, image

    shown: list[np.ndarray] = []
    monkeypatch.setattr(cv2, 'VideoCapture', Camera)
    # Windows would raise: the build of OpenCV that is installed has none.
    monkeypatch.setattr(cv2, 'imwrite', lambda name, image: shown.append(image))
    threads = cv2.getNumThreads()
    try:
        found: dict[str, Any] = {}
        exec(example('docs/library.md'), found)
    finally:
        cv2.setNumThreads(threads)
    assert [each.shape for each in shown] == [image.shape[:2] for image in images()]
    assert len(found['frame'].people) == 2

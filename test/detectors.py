# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A Python with a mediapipe that takes what is red for a person."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from test.walkers import clip

FATAL, ENDLESS = (3, 2, 1), (4, 2, 1)
"""Colours, BGR, of a first pixel with which it ends, or never answers."""

_MEDIAPIPE = f"""
import os, sys, time
from types import SimpleNamespace

os.write(1, b'not a map')


class Pose:
    def __init__(self, enable_segmentation):
        assert enable_segmentation

    def process(self, rgb):
        assert rgb.shape[0] < rgb.shape[1], 'all frames of the tests are broad'
        print('not a map either')
        first = tuple(rgb[0, 0, ::-1].tolist())
        if first == {FATAL}:
            sys.exit('out of memory')
        if first == {ENDLESS}:
            time.sleep(600)
        red = rgb[..., 0]
        return SimpleNamespace(segmentation_mask=red / 255 if red.any() else None)


solutions = SimpleNamespace(pose=SimpleNamespace(Pose=Pose))
"""


def fake_python(folder: Path, mediapipe: str = _MEDIAPIPE) -> str:
    """Write a program into a folder that is this Python with such a mediapipe."""
    (folder / 'mediapipe.py').write_text(mediapipe)
    python = folder / 'python'
    python.write_text(f'#!/bin/sh\nPYTHONPATH={folder} exec {sys.executable} "$@"\n')
    python.chmod(0o755)
    return str(python)


def image(first: tuple[int, int, int] = (0, 0, 0)) -> NDArray[np.uint8]:
    """Return a frame of a walker with a first pixel of a colour."""
    made = clip()[0].image.copy()
    made[0, 0] = first
    return made

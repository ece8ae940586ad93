# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The person mask of mediapipe's pose network: images on standard input, maps on standard output.

Run as a script by any Python that has mediapipe; neither this package nor ROS need be there.  Once
the network is loaded it writes ``READY``.  An image is its height and width (two little-endian
uint32) and height x width x 3 bytes of RGB; the answer has the same head and height x width bytes
of P(person), 255 = certain.  It ends with its input, and so with whoever started it.
"""

from __future__ import annotations

import os
import struct
import sys
from typing import BinaryIO

import numpy as np

READY = b'ready\n'
HEAD = struct.Struct('<II')

REQUIREMENT = 'mediapipe==0.10.14'
"""What pip is to install: of later versions some have no ``mediapipe.solutions``."""


def main() -> None:
    """Answer images until there are no more."""
    # Whatever else is printed, by libraries in C as well, must not come between the maps.
    answers = os.fdopen(os.dup(1), 'wb')
    os.dup2(2, 1)
    try:
        import mediapipe

        pose = mediapipe.solutions.pose.Pose(enable_segmentation=True)
    except (ImportError, AttributeError) as error:
        sys.exit(f'{error} ({sys.executable} -m pip install {REQUIREMENT} helps)')
    _write(answers, READY)
    while len(head := sys.stdin.buffer.read(HEAD.size)) == HEAD.size:
        height, width = HEAD.unpack(head)
        pixels = sys.stdin.buffer.read(3 * height * width)
        if len(pixels) < 3 * height * width:
            return
        mask = pose.process(np.frombuffer(pixels, np.uint8).reshape(height, width, 3))
        mask = mask.segmentation_mask
        if mask is None:
            mask = np.zeros((height, width), np.float32)
        _write(answers, head + np.rint(255 * np.clip(mask, 0, 1)).astype(np.uint8).tobytes())


def _write(stream: BinaryIO, data: bytes) -> None:
    stream.write(data)
    stream.flush()


if __name__ == '__main__':
    main()

#!/usr/bin/env python3
# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Make the clip that ships with the repository: a synthetic walker, with truth, in a few kilobytes.

``examples/walker`` is what this writes: 36 frames as JPEG, masks as PNG, and ``sequence.yaml``
with the first box and the true gait phase of every frame.  Usage::

    python benchmarks/example_clip.py [--out examples/walker]
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import cv2
import yaml

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.synthetic import SyntheticConfig, SyntheticSequence
from gait_segmentation.cli.tool import make_folder, run_tool
from gait_segmentation.files.output_files import write_file, writing
from gait_tools.evaluation.output import write_image

ROOT = Path(__file__).resolve().parents[1]
CLIP = SyntheticConfig(
    seed=1,
    width=256,
    height=192,
    fps=20.0,
    frames=36,
    person_height=110.0,
    stride_rate=0.95,
    noise=2.0,
)
QUALITY = 80
"""Of the frames' JPEG, 0..100."""


def write(folder: Path) -> None:
    """
    Write the clip as a sequence folder.

    :raises SequenceError: if it cannot be written.
    """
    clip = SyntheticSequence(CLIP)
    (folder / 'frames').mkdir(parents=True, exist_ok=True)
    phases = []
    for frame in clip:
        path = folder / 'frames' / f'{frame.number:04d}.jpg'
        _, data = cv2.imencode(path.suffix, frame.image, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
        with writing(path):
            write_file(path, data.tobytes())
        write_image(folder / 'masks' / f'{frame.number:04d}.png', frame.truths[0])
        phases.append(round(frame.phases[0], 4))
    box = clip.initial_box
    assert box is not None
    about: dict[str, Any] = {
        'fps': CLIP.fps,
        'initial_box': [box.x, box.y, box.width, box.height],
        'initial_frame': 0,
        'phases': phases,
        'notes': f'synthetic, seed {CLIP.seed}, by benchmarks/example_clip.py',
    }
    path = folder / 'sequence.yaml'
    with writing(path):
        write_file(path, yaml.safe_dump(about, sort_keys=False, default_flow_style=None).encode())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('--out', type=Path, default=ROOT / 'examples/walker', metavar='DIR')
    options = parser.parse_args()
    make_folder('--out', options.out)
    write(options.out)


if __name__ == '__main__':
    sys.exit(run_tool('example_clip.py', main))

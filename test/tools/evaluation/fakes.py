# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A pipeline that knows the answer more or less, and small sequences on disk."""

import itertools
from types import SimpleNamespace

import cv2
import numpy as np
import yaml

from gait_segmentation.geometry import BodyFrame, Box
from gait_segmentation.pipeline import PersonResult, PipelineConfig
from gait_segmentation.results import MatchResult, SegmentationResult, TrackResult
from gait_tools.evaluation.runner import run


def found_person(track_id, box, mask):
    """Return a person in a slot, as a pipeline finds one."""
    black = np.zeros((1, 1), np.uint8)
    return PersonResult(
        TrackResult(1, track_id, box, black, 1.0),
        MatchResult.empty(1, track_id, (1, 1)),
        SegmentationResult(1, track_id, mask, ''),
    )


class FakePipeline:
    """
    Takes red pixels for the person.

    Without texture it loses the lower half; without stillness it keeps the mask of who has left.
    """

    def __init__(self, config=None, bank=None, clock=lambda: 0.0):
        self.config = config or PipelineConfig()
        self.box = None
        self.held = []
        self.last = None
        self.images = []
        self.heat_maps = {}

    def initialize(self, box):
        self.box = box

    def add_heat_map(self, heat_map, stamp_ns):
        self.heat_maps[len(self.images)] = (heat_map, stamp_ns)

    def update(self, image, stamp_ns):
        self.images.append(image)
        mask = np.where(image[..., 2] > image[..., 1] + 60, 255, 0).astype(np.uint8)
        if not (mask.any() or self.config.tracking.use_stillness):
            mask = self.last
        self.last = mask.copy()
        if not self.config.tracking.use_texture:
            mask[mask.shape[0] // 2 :] = 0
        if self.config.segmentation.prior == 'none':
            mask[:, -1] = 255
        box = Box.around(mask)
        body = None
        if box is not None:
            body = BodyFrame(box.center_x, box.center_y, box.height)
        self.held.append(
            SimpleNamespace(
                stamp_ns=stamp_ns,
                people=(
                    SimpleNamespace(
                        track=SimpleNamespace(
                            track_id=1, box=box, body=box, state='tracked', likelihood=mask
                        ),
                        match=SimpleNamespace(
                            body=body, phase=0.25, azimuth=0.0, placed=box, box=box
                        ),
                        segmentation=SimpleNamespace(stamp_ns=stamp_ns, track_id=1, mask=mask),
                    ),
                ),
                timings_ms={'tracking': 1.0, 'matching': 2.0, 'segmentation': 3.0, 'total': 6.0},
            )
        )
        if len(self.held) <= self.config.matching.lag:
            return []
        return [self.held.pop(0)]

    def flush(self):
        held, self.held = self.held, []
        return held

    def reset(self):
        self.box, self.held = None, []


def write_sequence(folder, frames=8, size=(48, 40), suffix='png', without_mask=()):
    """Write a red man walking to the right before grey, with an ambiguous rim."""
    width, height = size
    (folder / 'frames').mkdir(parents=True)
    (folder / 'masks').mkdir()
    for number in range(frames):
        image = np.full((height, width, 3), 120, np.uint8)
        left = 4 + 2 * number
        mask = np.zeros((height, width), np.uint8)
        mask[5:36, left - 1 : left + 11] = 170
        mask[6:35, left : left + 10] = 255
        image[6:35, left : left + 10] = (30, 30, 200)
        cv2.imwrite(str(folder / 'frames' / f'{number:04d}.{suffix}'), image)
        if number not in without_mask:
            cv2.imwrite(str(folder / 'masks' / f'{number:04d}.png'), mask)
    about = {'fps': 25, 'initial_box': [3, 5, 12, 31], 'initial_frame': 0}
    (folder / 'sequence.yaml').write_text(yaml.safe_dump(about))
    return folder


def write_mot(folder, lines, info='', images=()):
    """Write a folder of MOTChallenge: lines of its gt.txt, and of its seqinfo.ini if any."""
    for name in ('gt', 'img1'):
        (folder / name).mkdir(parents=True)
    (folder / 'gt/gt.txt').write_text('\n'.join(lines))
    if info:
        (folder / 'seqinfo.ini').write_text(info)
    for number, image in enumerate(images, 1):
        cv2.imwrite(str(folder / f'img1/{number:06d}.png'), image)
    return folder


def run_sequence(pipeline, sequence, **options):
    """Return what a pipeline makes of a sequence, each call taking a second."""
    clock = itertools.count().__next__
    return list(run(pipeline, sequence, sequence.numbers, sequence.starts, clock=clock, **options))

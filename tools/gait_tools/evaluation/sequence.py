# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Sequences with ground truth on disk.

A sequence is a folder with ``frames/NNNN.png`` (or another image format), ``masks/NNNN.png`` and
``sequence.yaml``.  In a mask 255 is the person, 0 the background, and any other value is
ambiguous and left out of every score.  The YAML file has ``fps``, ``initial_box`` (x, y, width,
height in pixels) and ``initial_frame`` (the number of the frame the box belongs to, 0 if absent).

Where several people are labelled there is ``labels/NNNN.png``, too: 0 nobody, 1 to 16 one person
each, any other value (255) ambiguous.  The YAML file then may go without ``initial_box`` and may
have ``initial_boxes``: a list of boxes of ``initial_frame``, or of ``{frame: .., box: [..]}``.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import SequenceError
from gait_segmentation.files.image_files import IMAGE_SUFFIXES, read_image
from gait_segmentation.geometry import Box
from gait_tools.evaluation.attendance import Attendance
from gait_tools.evaluation.description import Description
from gait_tools.evaluation.metrics import start_box
from gait_tools.evaluation.truth import labels_of_truth, read_mask, truth_of

__all__ = ['Sequence', 'frame_stamp_ns']

_FIRST_STAMP_NS = 1_000_000_000
"""Stamp of frame 0: a stamp of zero means "no stamp" to the stages."""

_NUMBER = re.compile(r'[0-9]+$')


def frame_stamp_ns(place: int, fps: float) -> int:
    """Return the stamp of a frame in nanoseconds by its place in a clip, counted from 0."""
    return _FIRST_STAMP_NS + round(place * 1e9 / fps)


@dataclass(frozen=True)
class Sequence:
    """
    One clip with its ground truth; images are read when they are asked for.

    ``frames`` maps the frame numbers (from the file names, ascending) to files, ``masks`` the
    numbers that have ground truth.  ``size`` is (width, height) of all frames.  ``label_files``
    maps the numbers that have labels of several people to files; it is empty where only one is
    labelled.  ``given_boxes`` maps frame numbers to the boxes that start tracks there as the YAML
    file has them; ``initial_box`` is the first of them, None if it has none.  ``all_given`` says
    that nobody else is to be tracked.
    """

    name: str
    folder: Path
    fps: float
    initial_box: Box | None
    initial_frame: int
    size: tuple[int, int]
    frames: dict[int, Path] = field(repr=False)
    masks: dict[int, Path] = field(repr=False)
    label_files: dict[int, Path] = field(default_factory=dict, repr=False)
    given_boxes: dict[int, tuple[Box, ...]] = field(default_factory=dict, repr=False)
    all_given: bool = True

    @classmethod
    def load(cls, folder: str | Path) -> Sequence:
        """
        Open a sequence folder, reading its YAML file and the first frame.

        :raises SequenceError: if a part is missing or a value cannot be used; the message names
            the file, the value and what is allowed.
        """
        folder = Path(folder)
        if not folder.is_dir():
            raise SequenceError(f'{folder} is not a folder')
        if not (folder / 'sequence.yaml').exists():
            raise SequenceError(
                f'{folder} is no sequence: there is no sequence.yaml (with fps and initial_box) '
                'beside frames/ and masks/'
            )
        about = Description.read(folder / 'sequence.yaml')
        frames = _numbered(folder / 'frames', IMAGE_SUFFIXES)
        if not frames:
            raise SequenceError(
                f'{folder / "frames"} has no images named by number, like 0000.png or 0000.jpg'
            )
        masks = _pixelwise(folder / 'masks')
        labels = _pixelwise(folder / 'labels') if (folder / 'labels').is_dir() else {}
        for what, paths in (('mask', masks), ('label image', labels)):
            for number, path in paths.items():
                if number not in frames:
                    raise SequenceError(f'{path} is the {what} of a frame that is not in frames/')
        fps = about.fps()
        first = about.initial_frame(frames)
        image = read_image(frames[first])
        size = (image.shape[1], image.shape[0])
        given = about.boxes(frames, size, needed=not labels)
        box = next(iter(given.values()))[0] if given else None
        name = folder.resolve().name
        whole = not labels or about.has_all_boxes
        return cls(name, folder, fps, box, first, size, frames, masks, labels, given, whole)

    @property
    def numbers(self) -> list[int]:
        """Return the numbers of the frames from ``initial_frame`` on."""
        return [number for number in self.frames if number >= self.initial_frame]

    def stamp_ns(self, number: int) -> int:
        """Return the stamp of a frame in nanoseconds, from its number and the frame rate."""
        return frame_stamp_ns(number - min(self.frames), self.fps)

    def image(self, number: int) -> NDArray[np.uint8]:
        """
        Read a frame as (H, W, 3) uint8 BGR.

        :raises SequenceError: if it cannot be read or has another size than the first.
        """
        image = read_image(self.frames[number])
        if image.shape[:2] != (self.size[1], self.size[0]):
            raise SequenceError(
                f'{self.frames[number]} is {image.shape[1]}x{image.shape[0]}, but must be '
                f'{self.size[0]}x{self.size[1]} like the first frame'
            )
        return image

    def truth(self, number: int) -> NDArray[np.uint8] | None:
        """
        Read the ground truth of a frame as (H, W) uint8, None if the frame has none.

        :raises SequenceError: if the mask cannot be read or has another size than the frames.
        """
        path = self.masks.get(number)
        return None if path is None else read_mask(path, self.size)

    def labels(self, number: int) -> NDArray[np.uint8] | None:
        """
        Read who is where in a frame, None if the frame has no truth.

        :returns: (H, W) uint8, 0 nobody, 1 to 16 people, above ambiguous.  Without labels of
            several people the person of the mask is 1.
        :raises SequenceError: if a file cannot be read or has another size than the frames.
        """
        if self.label_files:
            path = self.label_files.get(number)
            return None if path is None else read_mask(path, self.size)
        truth = self.truth(number)
        return None if truth is None else labels_of_truth(truth)

    @cached_property
    def attendance(self) -> Attendance:
        """Return who is to be seen when, from ``initial_frame`` on."""
        truths = ((number, self.labels(number)) for number in self.numbers)
        known = ((number, labels) for number, labels in truths if labels is not None)
        return Attendance(known, self.fps, self.size)

    @cached_property
    def starts(self) -> dict[int, tuple[Box, ...]]:
        """
        Return the boxes that start tracks, by the number of their frame.

        They are those of the YAML file.  If it has no ``initial_boxes``, everybody else who is
        labelled starts from their box (with its ambiguous rim) in the first frame that shows all
        of them.
        """
        starts = dict(self.given_boxes)
        if self.all_given:
            return starts
        known = {
            self.attendance.person_at(box, number)
            for number, boxes in starts.items()
            for box in boxes
        }
        for person in self.attendance.people:
            number = self.attendance.first_whole(person)
            labels = None if person in known or number is None else self.labels(number)
            if number is None or labels is None:
                continue
            box = start_box(truth_of(labels, person))
            if box is not None:
                starts[number] = (*starts.get(number, ()), box)
        return dict(sorted(starts.items()))


def _pixelwise(folder: Path) -> dict[int, Path]:
    """Return images whose values mean something, by number."""
    found = _numbered(folder, ('.png',))
    others = [] if found else sorted(_numbered(folder, IMAGE_SUFFIXES).values())
    if others:
        raise SequenceError(f'{others[0]} must be a .png: other formats may change its values')
    return found


def _numbered(folder: Path, suffixes: tuple[str, ...]) -> dict[int, Path]:
    if not folder.is_dir():
        raise SequenceError(f'{folder} is missing')
    found: dict[int, Path] = {}
    for path in sorted(folder.iterdir()):
        if path.suffix.lower() not in suffixes:
            continue
        ending = _NUMBER.search(path.stem)
        if ending is None:
            raise SequenceError(
                f'{path} must be named by its number, like 0000{path.suffix} or '
                f'frame_0000{path.suffix}'
            )
        number = int(ending[0])
        if number in found:
            raise SequenceError(f'{path} and {found[number].name} have the same number')
        found[number] = path
    return dict(sorted(found.items()))

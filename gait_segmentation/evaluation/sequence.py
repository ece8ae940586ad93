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

import math
import re
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import yaml
from numpy.typing import NDArray

from gait_segmentation.errors import SequenceError
from gait_segmentation.evaluation.attendance import Attendance
from gait_segmentation.evaluation.metrics import start_box
from gait_segmentation.evaluation.truth import labels_of_truth, truth_of
from gait_segmentation.geometry import Box

__all__ = ['FRAME_SUFFIXES', 'Sequence', 'read_image', 'read_mask']

FRAME_SUFFIXES = ('.bmp', '.jpeg', '.jpg', '.pgm', '.png', '.ppm', '.tif', '.tiff', '.webp')
"""Endings of the files taken as frames."""

FIRST_STAMP_NS = 1_000_000_000
"""Stamp of frame 0: a stamp of zero means "no stamp" to the stages."""

_NUMBER = re.compile(r'[0-9]+$')


def read_image(path: Path) -> NDArray[np.uint8]:
    """
    Read a colour image as (H, W, 3) uint8 BGR.

    :raises SequenceError: if the file is not an image OpenCV can read.
    """
    return _decode(path, cv2.IMREAD_COLOR)


def read_mask(path: Path, size: tuple[int, int]) -> NDArray[np.uint8]:
    """
    Read a single-channel image as (H, W) uint8, its values as they are.

    :param size: the width and height it must have.
    :raises SequenceError: if it cannot be read, has another size, colours or 16 bits.
    """
    mask = _decode(path, cv2.IMREAD_UNCHANGED)
    if mask.ndim == 3 and (mask[..., :1] == mask[..., 1:3]).all():
        mask = np.ascontiguousarray(mask[..., 0])
    if mask.ndim != 2 or mask.dtype != np.uint8:
        raise SequenceError(
            f'{path} must be a grey image of 8 bits, got shape {mask.shape} of {mask.dtype}'
        )
    if mask.shape != (size[1], size[0]):
        raise SequenceError(
            f'{path} is {mask.shape[1]}x{mask.shape[0]}, but must be {size[0]}x{size[1]} '
            'like its frame'
        )
    return mask


def _decode(path: Path, flags: int) -> NDArray[np.uint8]:
    try:
        data = np.fromfile(path, dtype=np.uint8)
    except OSError as error:
        raise SequenceError(f'{path} cannot be read: {error.strerror}') from error
    try:
        image = cv2.imdecode(data, flags) if data.size else None
    except cv2.error:
        image = None
    if image is None:
        raise SequenceError(f'{path} is not a complete image')
    return np.asarray(image)


@dataclass(frozen=True)
class Sequence:
    """
    One clip with its ground truth; images are read when they are asked for.

    ``frames`` maps the frame numbers (from the file names, ascending) to files, ``masks`` the
    numbers that have ground truth.  ``size`` is (width, height) of all frames.  ``label_files``
    maps the numbers that have labels of several people to files; it is empty where only one is
    labelled.  ``given_boxes`` maps frame numbers to the boxes that start tracks there as the YAML
    file has them; ``initial_box`` is the first of them, None if it has none.
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
        about_path = folder / 'sequence.yaml'
        about = _read_yaml(about_path)
        frames = _numbered(folder / 'frames', FRAME_SUFFIXES)
        if not frames:
            raise SequenceError(
                f'{folder / "frames"} has no images named by number, like 0000.png or 0000.jpg'
            )
        masks = _numbered(folder / 'masks', ('.png',))
        labels: dict[int, Path] = {}
        if (folder / 'labels').is_dir():
            labels = _numbered(folder / 'labels', ('.png',))
        for what, paths in (('mask', masks), ('label image', labels)):
            for number, path in paths.items():
                if number not in frames:
                    raise SequenceError(f'{path} is the {what} of a frame that is not in frames/')
        fps = _number(about, 'fps', about_path)
        if fps <= 0:
            raise SequenceError(f'fps in {about_path} must be positive, got {fps:g}')
        first = about.get('initial_frame', 0)
        if isinstance(first, bool) or first not in frames:
            raise SequenceError(
                f'initial_frame in {about_path} must be the number of a frame '
                f'({min(frames)} to {max(frames)}), got {first!r}'
            )
        image = read_image(frames[first])
        size = (image.shape[1], image.shape[0])
        given: dict[int, tuple[Box, ...]] = {}
        if 'initial_box' in about or not labels:
            if 'initial_box' not in about:
                raise SequenceError(f'{about_path} has no initial_box')
            given[first] = (_box('initial_box', about['initial_box'], about_path, size),)
        if 'initial_boxes' in about:
            given = _boxes(about, about_path, size, first, frames)
        box = next(iter(given.values()))[0] if given else None
        name = folder.resolve().name
        whole = not labels or 'initial_boxes' in about
        return cls(name, folder, fps, box, first, size, frames, masks, labels, given, whole)

    @property
    def numbers(self) -> list[int]:
        """Return the numbers of the frames from ``initial_frame`` on."""
        return [number for number in self.frames if number >= self.initial_frame]

    def stamp_ns(self, number: int) -> int:
        """Return the stamp of a frame in nanoseconds, from its number and the frame rate."""
        return FIRST_STAMP_NS + round((number - min(self.frames)) * 1e9 / self.fps)

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


def _read_yaml(path: Path) -> dict[str, Any]:
    try:
        about = yaml.safe_load(path.read_text(encoding='utf-8'))
    except OSError as error:
        raise SequenceError(f'{path} cannot be read: {error.strerror}') from error
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        problem = ' '.join(str(error).split())
        raise SequenceError(f'{path} is not YAML: {problem}') from error
    if not isinstance(about, dict):
        raise SequenceError(f'{path} must have names and values (fps, initial_box ...)')
    return about


def _finite(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _number(about: dict[str, Any], name: str, path: Path) -> float:
    if name not in about:
        raise SequenceError(f'{path} has no {name}')
    if not _finite(about[name]):
        raise SequenceError(f'{name} in {path} must be a number, got {about[name]!r}')
    return float(about[name])


def _box(name: str, values: Any, path: Path, size: tuple[int, int]) -> Box:
    if not (isinstance(values, list) and len(values) == 4 and all(map(_finite, values))):
        raise SequenceError(
            f'{name} in {path} must be four numbers x, y, width, height, got {values!r}'
        )
    if values[2] <= 0 or values[3] <= 0:
        raise SequenceError(
            f'{name} in {path} must have a positive width and height, got {values}'
        )
    box = Box(*map(float, values))
    if box.clipped(*size) is None:
        raise SequenceError(
            f'{name} in {path} must overlap the image of {size[0]}x{size[1]}, got {values}'
        )
    return box


def _boxes(
    about: dict[str, Any],
    path: Path,
    size: tuple[int, int],
    first: int,
    frames: dict[int, Path],
) -> dict[int, tuple[Box, ...]]:
    entries = about['initial_boxes']
    if not (isinstance(entries, list) and entries):
        raise SequenceError(f'initial_boxes in {path} must be a list of boxes, got {entries!r}')
    boxes: dict[int, tuple[Box, ...]] = {}
    for entry in entries:
        number, values = first, entry
        if isinstance(entry, dict):
            number, values = entry.get('frame', first), entry.get('box')
        if isinstance(number, bool) or number not in frames or number < first:
            raise SequenceError(
                f'a frame of initial_boxes in {path} must be the number of a frame from '
                f'{first} on, got {number!r}'
            )
        box = _box('a box of initial_boxes', values, path, size)
        boxes[number] = (*boxes.get(number, ()), box)
    return dict(sorted(boxes.items()))

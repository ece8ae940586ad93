# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Sequences with ground truth on disk, as docs/evaluation.md describes them."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Container, Iterable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import InputError, SequenceError
from gait_segmentation.files import read_yaml
from gait_segmentation.geometry import Box, check_start_box
from gait_segmentation.heat_maps import HeatMap
from gait_segmentation.inputs.folder import IMAGE_SUFFIXES, load_heat_map, load_image
from gait_tools.evaluation.metrics import labels_of_truth, start_box, truth_of
from gait_tools.evaluation.tracking_score import Attendance

Frames = dict[int, Path]
Boxes = dict[int, tuple[Box, ...]]

_FIRST_STAMP_NS = 1_000_000_000  # stamp of frame 0: a stamp of zero means "no stamp" to the stages
RATES_HZ = (0.01, 1000.0)
_NUMBER = re.compile(r'[0-9]+$')
_TIMED = re.compile(r'([^:]+)(?::([0-9]+)(?::([1-9][0-9]*))?)?')  # NAME[:LATE[:EVERY]]


def frame_stamp_ns(place: int, fps: float) -> int:
    """Return the stamp of a frame in nanoseconds by its place in a clip, counted from 0."""
    return _FIRST_STAMP_NS + round(place * 1e9 / fps)


@dataclass(frozen=True)
class SequenceFolder:
    """A clip in a folder, which gives it its name."""

    folder: Path

    @property
    def name(self) -> str:
        """Return the name of the folder."""
        return self.folder.resolve().name


Clip = TypeVar('Clip', bound=SequenceFolder)


def named_apart(clips: Iterable[Clip]) -> list[Clip]:
    """Return clips as they are; SequenceError if two have the same name."""
    named: dict[str, Clip] = {}
    for clip in clips:
        first = named.setdefault(clip.name, clip)
        if first is not clip:
            raise SequenceError(
                f'{clip.folder} has the same name as {first.folder}; every sequence needs a name '
                'of its own'
            )
    return list(named.values())


@dataclass(frozen=True)
class Sequence(SequenceFolder):
    """
    One clip with its ground truth; images are read when they are asked for.

    ``about`` is the content of ``sequence.yaml``, ``size`` (width, height) of all frames;
    ``given_boxes`` are by the number of the frame in which they start tracks.
    """

    about: dict[str, Any] = field(repr=False)
    fps: float
    initial_frame: int
    size: tuple[int, int]
    frames: Frames = field(repr=False)
    masks: Frames = field(repr=False)
    label_files: Frames = field(repr=False)
    given_boxes: Boxes = field(repr=False)

    @classmethod
    def load(cls, folder: str | Path) -> Sequence:
        """Open a sequence folder, reading its YAML file and the first frame."""
        folder = Path(folder)
        if not folder.is_dir():
            raise SequenceError(f'{folder} is not a folder')
        path = folder / 'sequence.yaml'
        if not path.exists():
            raise SequenceError(
                f'{folder} is no sequence: there is no sequence.yaml (with fps and initial_box) '
                'beside frames/ and masks/'
            )
        frames = _numbered(folder / 'frames', IMAGE_SUFFIXES)
        if not frames:
            raise SequenceError(
                f'{folder / "frames"} has no images named by number, like 0000.png or 0000.jpg'
            )
        masks = _pixelwise(folder / 'masks')
        labels = _pixelwise(folder / 'labels') if (folder / 'labels').is_dir() else {}
        for what, paths in (('mask', masks), ('label image', labels)):
            for number in paths.keys() - frames.keys():
                raise SequenceError(
                    f'{paths[number]} is the {what} of a frame that is not in frames/'
                )
        about = read_yaml(path, SequenceError)
        if not isinstance(about, dict):
            raise SequenceError(f'{path} must have names and values (fps, initial_box ...)')
        fps, first = _fps(about, path), _initial_frame(about, path, frames)
        image = load_image(frames[first])
        size = (image.shape[1], image.shape[0])
        boxes = _given_boxes(about, path, first, frames, size)
        if not boxes and not labels:
            raise SequenceError(f'{path} has no initial_box')
        return cls(folder, about, fps, first, size, frames, masks, labels, boxes)

    @property
    def initial_box(self) -> Box | None:
        """Return the first box that is given, None without any."""
        return next((box for boxes in self.given_boxes.values() for box in boxes), None)

    @property
    def numbers(self) -> list[int]:
        """Return the numbers of the frames from ``initial_frame`` on."""
        return [number for number in self.frames if number >= self.initial_frame]

    def stamp_ns(self, number: int) -> int:
        """Return the stamp of a frame in nanoseconds, from its number and the frame rate."""
        return frame_stamp_ns(number - min(self.frames), self.fps)

    def image(self, number: int) -> NDArray[np.uint8]:
        """Read a frame as (H, W, 3) uint8 BGR."""
        image = load_image(self.frames[number])
        _check_size(self.frames[number], image, self.size, 'the first frame')
        return image

    def truth(self, number: int) -> NDArray[np.uint8] | None:
        """Read the ground truth of a frame as (H, W) uint8, None if the frame has none."""
        path = self.masks.get(number)
        return None if path is None else read_mask(path, self.size)

    def labels(self, number: int) -> NDArray[np.uint8] | None:
        """Read who is where, (H, W) uint8; without labels of several the person is 1."""
        if self.label_files:
            path = self.label_files.get(number)
            return None if path is None else read_mask(path, self.size)
        truth = self.truth(number)
        return None if truth is None else labels_of_truth(truth)

    def heat_maps(self, name: str) -> Callable[[int], HeatMap | None] | None:
        """Return what reads the map that comes with a frame, of ``NAME[:LATE[:EVERY]]``."""
        if not name:
            return None
        called = _TIMED.fullmatch(name)
        if called is None:
            raise SequenceError(
                f'heat maps must be NAME, NAME:LATE or NAME:LATE:EVERY, got {name}'
            )
        folder, late, every = called[1], int(called[2] or 0), int(called[3] or 1)
        if all(self.heat_map(folder, number) is None for number in self.frames):
            raise SequenceError(
                f'{self.folder / folder} has no heat map of a frame, like 0000.png'
            )
        numbers = self.numbers
        own = dict(zip(numbers[late::every], numbers[::every], strict=False))

        def read(number: int) -> HeatMap | None:
            values = self.heat_map(folder, own[number]) if number in own else None
            return None if values is None else HeatMap(values, self.stamp_ns(own[number]))

        return read

    def heat_map(self, name: str, number: int) -> NDArray[np.uint8] | None:
        """Read the map of a frame in a folder, (h, w) uint8, None if there is none of it."""
        folder = self.folder / name
        if not folder.is_dir():
            raise SequenceError(f'{folder} is missing, no heat maps to read')
        path = folder / f'{self.frames[number].stem}.png'
        return load_heat_map(path) if path.exists() else None

    @cached_property
    def attendance(self) -> Attendance:
        """Return who is to be seen when, from ``initial_frame`` on."""
        truths = ((number, self.labels(number)) for number in self.numbers)
        known = ((number, labels) for number, labels in truths if labels is not None)
        return Attendance(known, self.fps, self.size)

    @cached_property
    def starts(self) -> Boxes:
        """Return the given boxes and, of others who are labelled, the first whole one."""
        starts = dict(self.given_boxes)
        if not self.label_files or 'initial_boxes' in self.about:
            return starts
        known = {
            self.attendance.person_at(box, number)
            for number, boxes in starts.items()
            for box in boxes
        }
        for person in self.attendance.people:
            number = self.attendance.first_whole(person)
            labels = None if person in known or number is None else self.labels(number)
            box = None if labels is None else start_box(truth_of(labels, person))
            if number is not None and box is not None:
                starts[number] = (*starts.get(number, ()), box)
        return dict(sorted(starts.items()))


def _fps(about: dict[str, Any], path: Path) -> float:
    if 'fps' not in about:
        raise SequenceError(f'{path} has no fps')
    fps, (low, high) = about['fps'], RATES_HZ
    if not (_finite(fps) and low <= fps <= high):
        raise SequenceError(f'fps in {path} must be from {low:g} to {high:g}, got {fps!r}')
    return float(fps)


def _initial_frame(about: dict[str, Any], path: Path, frames: Frames) -> int:
    first = about.get('initial_frame', 0)
    if not _finite(first) or first not in frames:
        raise SequenceError(
            f'initial_frame in {path} must be the number of a frame '
            f'({min(frames)} to {max(frames)}), got {first!r}'
        )
    return int(first)


def _given_boxes(
    about: dict[str, Any], path: Path, first: int, frames: Container[int], size: tuple[int, int]
) -> Boxes:
    """Return the boxes of ``initial_boxes``, or else that of ``initial_box``, if any."""
    if 'initial_boxes' not in about:
        if 'initial_box' not in about:
            return {}
        return {first: (_box(f'initial_box in {path}', about['initial_box'], size),)}
    entries = about['initial_boxes']
    if not (isinstance(entries, list) and entries):
        raise SequenceError(f'initial_boxes in {path} must be a list of boxes, got {entries!r}')
    boxes: Boxes = {}
    for entry in entries:
        number, values = first, entry
        if isinstance(entry, dict):
            number, values = entry.get('frame', first), entry.get('box')
        if not _finite(number) or number not in frames or number < first:
            raise SequenceError(
                f'a frame of initial_boxes in {path} must be the number of a frame from '
                f'{first} on, got {number!r}'
            )
        box = _box(f'a box of initial_boxes in {path}', values, size)
        boxes[number] = (*boxes.get(number, ()), box)
    return dict(sorted(boxes.items()))


def _box(what: str, values: Any, size: tuple[int, int]) -> Box:
    if not (isinstance(values, list) and len(values) == 4 and all(map(_finite, values))):
        raise SequenceError(f'{what} must be four numbers x, y, width, height, got {values!r}')
    if values[2] <= 0 or values[3] <= 0:
        raise SequenceError(f'{what} must have a positive width and height, got {values}')
    box = Box(*map(float, values))
    try:
        check_start_box(box, size)
    except InputError as error:
        raise SequenceError(f'{what}: {error}') from error
    return box


def _finite(value: Any) -> bool:
    # Compared, since integers may be larger than any float.
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return number and abs(value) <= sys.float_info.max


def read_mask(path: Path, size: tuple[int, int]) -> NDArray[np.uint8]:
    """Read a grey image of a size as (H, W) uint8, its values as they are."""
    mask = load_image(path, cv2.IMREAD_UNCHANGED)
    if mask.ndim == 3 and (mask[..., :1] == mask[..., 1:3]).all():
        mask = np.ascontiguousarray(mask[..., 0])
    if mask.ndim != 2 or mask.dtype != np.uint8:
        raise SequenceError(
            f'{path} must be a grey image of 8 bits, got shape {mask.shape} of {mask.dtype}'
        )
    _check_size(path, mask, size, 'its frame')
    return mask


def _check_size(path: Path, image: NDArray[Any], size: tuple[int, int], like: str) -> None:
    if image.shape[1::-1] != size:
        raise SequenceError(
            f'{path} is {image.shape[1]}x{image.shape[0]}, but must be {size[0]}x{size[1]} '
            f'like {like}'
        )


def _pixelwise(folder: Path) -> Frames:
    """Return images whose values mean something, by number."""
    found = _numbered(folder, ('.png',))
    others = [] if found else sorted(_numbered(folder, IMAGE_SUFFIXES).values())
    if others:
        raise SequenceError(f'{others[0]} must be a .png: other formats may change its values')
    return found


def _numbered(folder: Path, suffixes: tuple[str, ...]) -> Frames:
    if not folder.is_dir():
        raise SequenceError(f'{folder} is missing')
    found: Frames = {}
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

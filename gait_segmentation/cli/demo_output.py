# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What gait_demo writes: masks, film, contact sheet, plot and report."""

from __future__ import annotations

import json
import math
import platform
from collections import Counter
from collections.abc import Sequence
from importlib import metadata
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.cli.recorder import Record
from gait_segmentation.cli.replaying.file_outputs import Film
from gait_segmentation.cli.replaying.mark import mask_png
from gait_segmentation.drawing import BACKDROP, draw_label, draw_person, track_colour
from gait_segmentation.errors import SequenceError
from gait_segmentation.files.output_files import write_file, write_picture
from gait_segmentation.geometry import Box
from gait_segmentation.inputs import ImageSource
from gait_segmentation.sheets import contact_sheet, spread, tile

__all__ = [
    'make_report',
    'write_masks',
    'write_phase',
    'write_pictures',
]

_GRID = (90, 90, 90)
"""Colour of the lines of plots."""


def person_mask(labels: NDArray[np.uint8], slot: int) -> NDArray[np.uint8]:
    """Return the mask of a slot, 0/255."""
    return np.where(labels == slot + 1, 255, 0).astype(np.uint8)


def write_masks(folder: Path, frames: Sequence[Record]) -> None:
    """
    Write ``NNNN.png`` for every frame, named by its number in the film.

    Those of an earlier run are removed.

    :raises OSError: if a file cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.glob('*.png'):
        old.unlink()
    for shown in frames:
        write_file(folder / f'{shown.number:04d}.png', mask_png(shown.mask))


def write_pictures(
    overlay: Path, sheet: Path, frames: Sequence[Record], film: ImageSource, fps: float
) -> None:
    """
    Write a film with outline, box, view and phase, and a contact sheet of who is seen longest.

    The images are read again, in their order: all at once would take much memory.

    :raises SequenceError: if a file cannot be written, or the film not be read again.
    """
    if not frames:
        raise SequenceError('there are no frames to write a film of')
    shown = {each.number: each for each in frames}
    slot, tiles = longest(frames), []
    seen = [each.number for each in frames if each.person(slot).box] or list(shown)
    chosen = spread(seen)
    made = Film(overlay, film.size, fps)
    for frame in film.frames():
        if frame.number not in shown:
            continue
        if frame.image is None:
            raise SequenceError(f'frame {frame.number} cannot be read any more: {frame.problem}')
        each = shown[frame.number]
        made.add(_drawn(frame.image.copy(), each), frame.number)
        if frame.number in chosen:
            tiles.append(_tile(frame.image, each, slot))
    made.close()
    write_picture(sheet, contact_sheet(tiles))


def _drawn(picture: NDArray[np.uint8], record: Record) -> NDArray[np.uint8]:
    labels = record.labels
    for slot, person in sorted(record.people.items()):
        if person.box is not None:
            draw_person(
                picture,
                mask=person_mask(labels, slot),
                box=person.box,
                track_id=person.track_id,
                phase=person.phase,
                azimuth=person.azimuth,
            )
    return picture


def longest(frames: Sequence[Record]) -> int:
    """Return the slot that somebody was seen in for most frames."""
    counts = Counter(
        slot for shown in frames for slot, person in shown.people.items() if person.box is not None
    )
    return min(counts, key=lambda slot: (-counts[slot], slot), default=0)


def _tile(image: NDArray[np.uint8], shown: Record, slot: int) -> NDArray[np.uint8]:
    """Return a crop of a frame about somebody, with outline, number and phase."""
    person = shown.person(slot)
    box = person.box or Box(0, 0, image.shape[1], image.shape[0])
    mask = person_mask(shown.labels, slot)
    phase = '' if math.isnan(person.phase) else f' {person.phase:.2f}'
    outlines = [(mask, track_colour(person.track_id))]
    return tile(image, box, outlines, f'{shown.number}{phase}')


def write_phase(path: Path, frames: Sequence[Record]) -> None:
    """
    Plot gait phase and walking direction of the person seen longest over time.

    :raises SequenceError: if the file cannot be written.
    """
    slot = longest(frames)
    times = np.array([shown.time_s for shown in frames])
    phase = np.array([shown.person(slot).phase for shown in frames])
    azimuth = np.rad2deg([shown.person(slot).azimuth for shown in frames]) % 360
    panels = (
        _panel('gait phase in strides, 0 = heel contact of the near leg', times, phase, 1, 0.25),
        _panel('walking direction in degrees, over time in seconds', times, azimuth, 360, 90),
    )
    write_picture(path, np.vstack(panels))


def _panel(
    title: str, times: NDArray[np.float64], values: NDArray[np.float64], top: float, step: float
) -> NDArray[np.uint8]:
    """Return a plot of values from 0 to ``top`` as dots, with lines at seconds and steps."""
    rows, columns, margin = 240, 880, 50
    picture = np.full((rows, columns, 3), BACKDROP, np.uint8)
    last = max(float(times.max()), 1.0)

    def place(time: float, value: float) -> tuple[int, int]:
        across, up = time / last, value / top
        return (
            round(margin + (columns - 2 * margin) * across),
            round(rows - margin / 2 - (rows - margin) * up),
        )

    for value in np.arange(0, top + step, step):
        cv2.line(picture, place(0, value), place(last, value), _GRID)
        draw_label(picture, f'{value:g}', (4, place(0, value)[1] - 8))
    for second in range(0, math.floor(last) + 1, math.ceil(last / 20)):
        cv2.line(picture, place(second, 0), place(second, top), _GRID)
        draw_label(picture, f'{second}', (place(second, 0)[0] - 6, rows - 18))
    for time, value in zip(times, values, strict=True):
        if not math.isnan(value):
            cv2.circle(picture, place(time, value), 2, track_colour(1), -1, cv2.LINE_AA)
    draw_label(picture, title, (margin, 4))
    return picture


def make_report(
    frames_in: int, frames: Sequence[Record], topics: dict[str, int]
) -> dict[str, Any]:
    """
    Sum up a run.

    :param frames_in: frames that the source published.
    :param frames: frames whose mask came.
    :param topics: messages received on each topic.
    """
    latency = [1e3 * shown.latency_s for shown in frames]
    # From the first frame taken to the last mask received, so that lateness counts.
    first = min((s.arrived_s - s.latency_s for s in frames), default=0.0)
    seconds = max((s.arrived_s for s in frames), default=0.0) - first
    median, high = np.percentile(latency, (50, 95)) if latency else (math.nan, math.nan)
    return {
        'frames_in': frames_in,
        'frames_out': len(frames),
        'dropped': frames_in - len(frames),
        'fps': round(len(frames) / seconds, 2) if seconds > 0 else 0.0,
        'latency_ms': {'p50': round(float(median), 1), 'p95': round(float(high), 1)},
        'tracked_frames': sum(bool(shown.labels.any()) for shown in frames),
        'tracks': {str(track_id): count for track_id, count in sorted(_tracks(frames).items())},
        'messages': topics,
        'versions': _versions(),
    }


def _tracks(frames: Sequence[Record]) -> Counter[int]:
    """Return in how many frames each track was seen."""
    return Counter(
        person.track_id
        for shown in frames
        for person in shown.people.values()
        if person.box is not None
    )


def write_report(path: Path, report: dict[str, Any]) -> None:
    """Write a report as JSON."""
    write_file(path, (json.dumps(report, indent=2) + '\n').encode())


def _versions() -> dict[str, str]:
    found = {'python': platform.python_version(), 'machine': platform.machine()}
    for name in ('gait_segmentation', 'numpy', 'opencv-python-headless', 'numba', 'rclpy'):
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    found['opencv'] = cv2.__version__
    return found

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Sequences and tracks as MOTChallenge has them, and how well the boxes of people are followed."""

from __future__ import annotations

import configparser
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gait_segmentation.errors import ConfigError, InputError, SequenceError, one_line
from gait_segmentation.geometry import Box
from gait_segmentation.inputs import ImageSource, InputFrame, open_input
from gait_segmentation.inputs.source import DEFAULT_FPS
from gait_tools.evaluation.sequence import RATES_HZ, SequenceFolder, named_apart
from gait_tools.evaluation.tracking_score import MISSING, SAME_IOU, MotFrame, accumulated

if TYPE_CHECKING:  # which takes long to load
    from gait_segmentation.pipeline import FrameResult

BoxesById = dict[int, dict[int, Box]]
"""Number of a frame, from 1 -> id -> box."""

_PEDESTRIAN = 1  # of the classes in a gt.txt
_CLASSED = (8, 9)  # columns of a gt.txt with classes; the 10 of MOT15 have places in metres there
_FIGURES = {
    'people': 'num_unique_objects',
    'mota': 'mota',
    'idf1': 'idf1',
    'recall': 'recall',
    'precision': 'precision',
    'id_switches': 'num_switches',
}


@dataclass(frozen=True)
class MotSequence(SequenceFolder):
    """
    One clip with true boxes; images are read when they are asked for.

    ``ambiguous`` are boxes of what is no pedestrian or to be ignored: who is tracked there is
    neither right nor wrong.
    """

    images: Path
    fps: float
    people: BoxesById = field(repr=False)
    ambiguous: BoxesById = field(repr=False)

    @staticmethod
    def is_at(folder: Path) -> bool:
        """Return whether a folder is of this kind."""
        return _truth_in(folder).exists()

    @classmethod
    def load(cls, folder: Path) -> MotSequence:
        """Open a folder, reading all true boxes."""
        images, fps = _about(folder / 'seqinfo.ini')
        people: BoxesById = {}
        ambiguous: BoxesById = {}
        for number, person, box, others in _rows(_truth_in(folder)):
            ignored = others[:1] == [0]
            other = len(others) + 6 in _CLASSED and others[1] != _PEDESTRIAN
            kind = ambiguous if ignored or other else people
            kind.setdefault(number, {})[person] = box
        if not people:
            raise SequenceError(f'{_truth_in(folder)} has no box of a pedestrian to be scored')
        return cls(folder, folder / images, fps, people, ambiguous)

    def source(self) -> ImageSource:
        """Open the images; frame 1 of the truth is the first, which has the number 0 there."""
        source = open_input(self.images, rate=self.fps)
        last = max(self.people)
        if source.total is not None and last > source.total:
            raise SequenceError(
                f'{_truth_in(self.folder)} has boxes in frame {last}, but {self.images} has '
                f'{source.total} images'
            )
        return source

    def compared(self, tracks: BoxesById) -> list[MotFrame]:
        """Return how tracks overlap with people, frame by frame, without ambiguous ones."""
        from motmetrics.lap import linear_sum_assignment

        frames: list[MotFrame] = []
        for number in sorted({*self.people, *self.ambiguous, *tracks}):
            people, found = self.people.get(number, {}), tracks.get(number, {})
            true = [*people.values(), *self.ambiguous.get(number, {}).values()]
            iou = np.array([[box.iou(other) for other in found.values()] for box in true])
            iou = iou.reshape(len(true), len(found)).astype(np.float64)
            # One to one, as MOTChallenge does it: who walks past an ambiguous box still counts.
            pairs = linear_sum_assignment(np.where(iou >= SAME_IOU, 1 - iou, np.nan))
            unclear = {
                track for person, track in zip(*pairs, strict=True) if person >= len(people)
            }
            kept = [place for place in range(len(found)) if place not in unclear]
            ids = list(found)
            frames.append((list(people), [ids[n] for n in kept], iou[: len(people), kept]))
        return frames


def load_mot_sequences(folders: Iterable[Path]) -> list[MotSequence]:
    """Open folders to be scored."""
    if find_spec('motmetrics') is None:
        raise ConfigError(MISSING)
    return named_apart(map(MotSequence.load, folders))


def read_tracks(path: Path, name: str) -> BoxesById:
    """
    Read a file of tracks, or the file of a sequence in a folder of them.

    The latter is called NAME.txt, as MOTChallenge wants it, or as gait_replay names what comes
    from NAME/img1.
    """
    if path.is_dir():
        files = [path / f'{name}.txt', path / f'{name}_img1.txt']
        path = next((each for each in files if each.exists()), files[0])
    tracks: BoxesById = {}
    for number, track_id, box, _ in _rows(path):
        tracks.setdefault(number, {})[track_id] = box
    return tracks


def found_boxes(results: Iterable[tuple[InputFrame, FrameResult]]) -> BoxesById:
    """Return who is seen in frames."""
    return {
        frame.number + 1: {
            each.track.track_id: each.track.box
            for each in result.people
            if each.track.box is not None
        }
        for frame, result in results
    }


def mot_report(compared: Mapping[str, list[MotFrame]]) -> dict[str, Any]:
    """Score sequences by name: ``sequences``, and ``overall``, of all their frames as one."""
    import motmetrics

    rows = motmetrics.metrics.create().compute_many(
        list(map(accumulated, compared.values())),
        names=list(compared),
        metrics=list(_FIGURES.values()),
        generate_overall=True,
    )
    *each, overall = (
        {
            name: value if math.isfinite(value) else None
            for name, value in zip(_FIGURES, row, strict=True)
        }
        for row in rows.itertuples(index=False)
    )
    return {'sequences': dict(zip(compared, each, strict=True)), 'overall': overall}


def _truth_in(folder: Path) -> Path:
    return folder / 'gt' / 'gt.txt'


def _about(path: Path) -> tuple[str, float]:
    """Return the folder of the images and the frame rate, as a seqinfo.ini may say."""
    about = configparser.ConfigParser(interpolation=None)
    try:
        about.read(path, encoding='utf-8')
    except (configparser.Error, ValueError) as error:
        raise SequenceError(f'{path} cannot be used: {one_line(error)}') from error
    given: Mapping[str, str] = about['Sequence'] if about.has_section('Sequence') else {}
    rate, (low, high) = given.get('frameRate', f'{DEFAULT_FPS}'), RATES_HZ
    try:
        fps = float(rate)
    except ValueError:
        fps = math.nan
    if not low <= fps <= high:
        raise SequenceError(f'frameRate in {path} must be from {low:g} to {high:g}, got {rate!r}')
    return given.get('imDir', 'img1'), fps


def _rows(path: Path) -> Iterator[tuple[int, int, Box, list[float]]]:
    """Yield the frame, the id, the box and the other columns of each line."""
    seen: set[tuple[int, int]] = set()
    lines = path.read_text(encoding='utf-8', errors='replace').splitlines()
    for place, line in enumerate(lines, 1):
        if not line.strip():
            continue
        where = f'{path}, line {place}'
        try:
            values = [float(value) for value in line.split(',')]
        except ValueError:
            values = []
        if len(values) < 6:
            raise SequenceError(
                f'{where} must be numbers frame,id,x,y,width,height and others that may follow, '
                f'got {line[:80]!r}'
            )
        for name, value, least in (('frame', values[0], 1), ('id', values[1], 0)):
            if not (value >= least and value.is_integer()):
                raise SequenceError(
                    f'{where}: the {name} must be a whole number from {least} on, got {value:g}'
                )
        number, box_id = int(values[0]), int(values[1])
        if (number, box_id) in seen:
            raise SequenceError(
                f'{where}: every id must be there once in a frame, got id {box_id} again in '
                f'frame {number}'
            )
        seen.add((number, box_id))
        try:
            box = Box(*values[2:6])
        except InputError as error:
            raise SequenceError(f'{where}: {error}') from error
        yield number, box_id, box, values[6:]

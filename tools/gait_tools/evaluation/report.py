# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What is said of an evaluation: numbers and their means, tables, masks and sheets."""

from __future__ import annotations

import statistics
from collections.abc import Iterable, Mapping, Sequence as ListLike
from dataclasses import dataclass, field
from functools import reduce
from operator import attrgetter, getitem
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.drawing import Image, track_colour
from gait_segmentation.geometry import Box
from gait_tools.evaluation.metrics import PERSON, FrameScore, mean_known, true_box
from gait_tools.evaluation.runner import Outcome
from gait_tools.evaluation.sequence import Sequence
from gait_tools.evaluation.tracking_score import MISSING, TrackingScore
from gait_tools.outputs import write_image
from gait_tools.sheets import contact_sheet, spread, tile

FOUND, TRUE = track_colour(1), (255, 90, 255)  # colours of outlines
STAGES = ('tracking', 'matching', 'segmentation', 'total')
BOXES = ('tracked', 'placed', 'matched')
_SUMMED = (
    *('frames', 'lost_frames', 'id_switches', 'shared_ids', 'false_slots', 'false_frames'),
    *('never_locked', 'never_recovered'),
)
_LONGEST = ('lock_seconds', 'recovery_seconds')


@dataclass
class Summary:
    """Collects the outcomes of one sequence, without their images."""

    tracking: TrackingScore
    scores: list[FrameScore] = field(default_factory=list)
    timings: list[Mapping[str, float]] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)

    def add(self, outcome: Outcome, labels: NDArray[np.uint8] | None) -> None:
        """Take in one frame."""
        if labels is not None:
            self.tracking.add(outcome.number, labels, outcome.people)
        if outcome.score is not None:
            self.scores.append(outcome.score)
        if outcome.timings_ms:
            self.timings.append(outcome.timings_ms)
        self.seconds.append(outcome.seconds)

    def numbers(self) -> dict[str, Any]:
        """Return the scores; ``ms_per_frame`` are medians, ``fps`` counts the start, too."""

        def mean(name: str) -> float | None:
            return mean_known(map(attrgetter(name), self.scores))

        total = sum(self.seconds)
        return {
            'frames': len(self.scores),
            'J': mean('j'),
            'F': mean('f'),
            'collapsed': mean('collapsed'),
            'error_rate': mean('error_rate'),
            'error_rate_image': mean('error_rate_image'),
            'box_iou': mean('visible.iou'),
            **{
                name: {
                    'box_iou': mean(f'{name}.iou'),
                    'centre_error': mean(f'{name}.centre_error'),
                }
                for name in BOXES
            },
            'lost_frames': sum(score.lost for score in self.scores),
            'ms_per_frame': {
                stage: statistics.median([times.get(stage, 0.0) for times in self.timings] or [0])
                for stage in STAGES
            },
            'fps': len(self.seconds) / total if total > 0 else 0.0,
            'tracking': self.tracking.numbers(),
        }


def mean_of(rows: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """Put the numbers of sequences together: means, sums of counts, the longest of times."""
    rows = list(rows)
    mean: dict[str, Any] = {}
    for name in rows[0]:
        values = [row[name] for row in rows]
        if name == 'people':
            continue
        if isinstance(values[0], Mapping):
            mean[name] = mean_of(values)
        elif name in _SUMMED:
            mean[name] = sum(values)
        elif name in _LONGEST:
            mean[name] = max((each for each in values if each is not None), default=None)
        else:
            mean[name] = mean_known(values)
    return mean


def aligned(rows: ListLike[ListLike[str]]) -> str:
    """Join cells to lines, the first column flush left and the others right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = []
    for first, *others in rows:
        cells = [each.rjust(width) for each, width in zip(others, widths[1:], strict=True)]
        lines.append('  '.join([first.ljust(widths[0]), *cells]).rstrip())
    return '\n'.join(lines)


Columns = Mapping[str, tuple[str, int]]
"""Title of a column -> which number is in it (``name`` or ``group.name``), and its digits."""

_COLUMNS: Columns = {
    'frames': ('frames', 0),
    'J': ('J', 4),
    'F': ('F', 4),
    'error %': ('error_rate', 2),
    'image %': ('error_rate_image', 2),
    'box IoU': ('box_iou', 3),
    'tracked': ('tracked.box_iou', 3),
    'placed': ('placed.box_iou', 3),
    'matched': ('matched.box_iou', 3),
    'lost': ('lost_frames', 0),
    'ms': ('ms_per_frame.total', 1),
    'fps': ('fps', 1),
}
_WARM_COLUMNS: Columns = {'warm J': ('warm.J', 4), 'J0': ('warm.J0', 4)}
_TRACKING_COLUMNS: Columns = {
    'J': ('J', 4),
    'one id': ('J_one_id', 4),
    'box IoU': ('box_iou', 3),
    'centre': ('centre_error', 3),
    'lost': ('lost_frames', 0),
    'switches': ('id_switches', 0),
    'shared': ('shared_ids', 0),
    'MOTA': ('mota', 3),
    'IDF1': ('idf1', 3),
    'lock s': ('lock_seconds', 2),
    'back s': ('recovery_seconds', 2),
    'false': ('false_slots', 0),
}
_MOT_COLUMNS: Columns = {
    'people': ('people', 0),
    'MOTA': ('mota', 3),
    'IDF1': ('idf1', 3),
    'recall': ('recall', 3),
    'precision': ('precision', 3),
    'switches': ('id_switches', 0),
}
_NEVER = {'lock s': 'never_locked', 'back s': 'never_recovered'}
_PLACE_COLUMNS = ('J', 'error %', 'box IoU', *BOXES)


def _cells(columns: Columns, numbers: Mapping[str, Any]) -> list[str]:
    cells = []
    for title, (name, digits) in columns.items():
        value = reduce(getitem, name.split('.'), numbers)
        never = numbers.get(_NEVER.get(title, ''))
        cell = '-' if value is None else f'{value:.{digits}f}'
        cells.append(f'{cell} ({never} never)' if never else cell)
    return cells


def _lines(report: Mapping[str, Any]) -> list[tuple[str, dict[str, Any]]]:
    """Return the names and numbers of all sequences and of their mean, warm starts besides."""
    warm = report.get('warm', {'per_sequence': {}})
    lines = [
        (name, numbers | {'warm': warm['per_sequence'].get(name)})
        for name, numbers in report['sequences'].items()
    ]
    return [*lines, ('mean', report['mean'] | {'warm': warm})]


def table(report: Mapping[str, Any]) -> str:
    """Return the report as an aligned table, one line per sequence and one for the mean."""
    columns = {**_COLUMNS, **(_WARM_COLUMNS if 'warm' in report else {})}
    rows = [[name, *_cells(columns, numbers)] for name, numbers in _lines(report)]
    return aligned([['sequence', *columns], *rows])


def tracking_table(report: Mapping[str, Any]) -> str:
    """Return how people were followed as an aligned table, one line per sequence and the mean."""
    known = 'mota' in report['mean']['tracking']
    columns = {k: v for k, v in _TRACKING_COLUMNS.items() if known or k not in ('MOTA', 'IDF1')}
    rows = [['tracking', 'people', *columns]]
    for name, numbers in _lines(report):
        scores = numbers['tracking']
        people = str(len(scores['people'])) if 'people' in scores else ''
        rows.append([name, people, *_cells(columns, scores)])
    return aligned(rows) + ('' if known else f'\n({MISSING})')


def mot_table(report: Mapping[str, Any]) -> str:
    """Return how boxes were followed as an aligned table, one line per sequence and for all."""
    lines = [*report['sequences'].items(), ('overall', report['overall'])]
    rows = [[name, *_cells(_MOT_COLUMNS, numbers)] for name, numbers in lines]
    return aligned([['boxes', *_MOT_COLUMNS], *rows])


def place_table(report: Mapping[str, Any], sequences: Iterable[Sequence]) -> str:
    """Return means over places by what ``sequence.yaml`` says; empty if none says ``place``."""
    sequences = list(sequences)
    if not any('place' in each.about for each in sequences):
        return ''
    groups: dict[str, dict[str, list[dict[str, Any]]]] = {}
    for each in sequences:
        kind, camera = (str(each.about.get(key, '?')) for key in ('kind', 'camera'))
        for group in (f'{kind}, {camera} camera', kind, 'all'):
            place = str(each.about.get('place', each.name))
            places = groups.setdefault(group, {})
            places.setdefault(place, []).append(report['sequences'][each.name])
    columns = {name: _COLUMNS[name] for name in _PLACE_COLUMNS} | {'collapsed %': ('share', 1)}
    if 'map_J' in report['mean']:
        columns['map J'] = ('map_J', 4)
    rows = [['by places', 'clips', 'places', *columns]]
    for group, places in sorted(groups.items(), key=lambda item: (item[0] == 'all', item[0])):
        mean = mean_of(map(mean_of, places.values()))
        mean['share'] = 100 * (mean['collapsed'] or 0)
        count = str(sum(map(len, places.values())))
        rows.append([group, count, str(len(places)), *_cells(columns, mean)])
    return aligned(rows)


class SequenceOutput:
    """Writes ``masks/NNNN.png`` and ``contact_sheet.png``, of 28 frames spread evenly."""

    def __init__(self, folder: Path, sequence: Sequence) -> None:
        """Begin to write to a folder, which is made if it is missing."""
        self._folder, self._sequence = folder, sequence
        self.shown = spread(sequence.numbers)
        self._tiles: list[Image] = []
        self._box: Box | None = None

    def add(self, outcome: Outcome) -> None:
        """Write the mask of a frame and draw it if it is to be shown."""
        number, sequence = outcome.number, self._sequence
        write_image(self._folder / 'masks' / f'{sequence.frames[number].stem}.png', outcome.mask)
        if number not in self.shown:
            return
        image, truth = sequence.image(number), sequence.truth(number)
        box = None if truth is None else true_box(truth)
        self._box = box or outcome.box or self._box or Box(0, 0, image.shape[1], image.shape[0])
        outlines = [(outcome.mask, FOUND)]
        if truth is not None:
            outlines.insert(0, (np.where(truth == PERSON, 255, 0).astype(np.uint8), TRUE))
        words = f'{number:04d}'
        if outcome.score is not None:
            words += f'  J {outcome.score.j:.3f}'
        self._tiles.append(tile(image, self._box, outlines, words))

    def close(self) -> None:
        """Write the contact sheet."""
        write_image(self._folder / 'contact_sheet.png', contact_sheet(self._tiles))

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What is said of an evaluation: numbers and their means, tables, JSON, masks and sheets."""

from __future__ import annotations

import io
import json
import math
import statistics
from collections.abc import Callable, Iterable, Mapping, Sequence as ListLike
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.drawing import Image, track_colour
from gait_segmentation.files import write_file
from gait_segmentation.geometry import Box
from gait_tools.evaluation.metrics import PERSON, FrameScore, mean_known, true_box
from gait_tools.evaluation.runner import Outcome
from gait_tools.evaluation.sequence import Sequence
from gait_tools.evaluation.tracking_score import MISSING, TrackingScore
from gait_tools.outputs import SAYS, write_picture, writing
from gait_tools.sheets import contact_sheet, spread, tile

if TYPE_CHECKING:  # which takes long to load
    from matplotlib.figure import Figure

FOUND, TRUE = track_colour(1), (255, 90, 255)  # colours of outlines
STAGES = ('tracking', 'matching', 'segmentation', 'total')
BOXES = ('tracked', 'placed', 'matched')
COLLAPSED = 0.5  # J below which a mask is no longer the person's
_AVERAGED = ('J', 'F', 'collapsed', 'error_rate', 'error_rate_image', 'box_iou', 'fps')
_TRACKING_SUMMED = (
    *('lost_frames', 'id_switches', 'shared_ids', 'false_slots', 'false_frames'),
    *('never_locked', 'never_recovered'),
)
_TRACKING_AVERAGED = ('J', 'J_one_id', 'box_iou', 'centre_error', 'mota', 'idf1')


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
        total = sum(self.seconds)
        return {
            'frames': len(self.scores),
            'J': mean_known(score.j for score in self.scores),
            'F': mean_known(score.f for score in self.scores),
            'collapsed': mean_known(
                float(score.j < COLLAPSED) for score in self.scores if not math.isnan(score.j)
            ),
            'error_rate': mean_known(score.error_rate for score in self.scores),
            'error_rate_image': mean_known(score.error_rate_image for score in self.scores),
            'box_iou': mean_known(score.visible.iou for score in self.scores),
            **{
                name: {
                    'box_iou': mean_known(getattr(each, name).iou for each in self.scores),
                    'centre_error': mean_known(
                        getattr(each, name).centre_error for each in self.scores
                    ),
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


def mean_of(sequences: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Average the sequences' numbers, each sequence counting the same; counts are summed."""
    rows = list(sequences.values())
    mean: dict[str, Any] = {
        'frames': sum(row['frames'] for row in rows),
        'lost_frames': sum(row['lost_frames'] for row in rows),
        'ms_per_frame': {
            stage: mean_known(row['ms_per_frame'][stage] for row in rows) for stage in STAGES
        },
    }
    for name in _AVERAGED:
        mean[name] = mean_known(row[name] for row in rows)
    for name in BOXES:
        mean[name] = {
            key: mean_known(row[name][key] for row in rows) for key in ('box_iou', 'centre_error')
        }
    if rows and all('map_J' in row for row in rows):
        mean['map_J'] = mean_known(row['map_J'] for row in rows)
    mean['tracking'] = mean_tracking(row['tracking'] for row in rows)
    return mean


def mean_tracking(rows: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """Put the scores of sequences together: means, sums of counts, the longest of times."""
    rows = list(rows)
    mean: dict[str, Any] = {name: sum(row[name] for row in rows) for name in _TRACKING_SUMMED}
    for name in _TRACKING_AVERAGED:
        if all(name in row for row in rows):
            mean[name] = mean_known(row[name] for row in rows)
    for name in ('lock_seconds', 'recovery_seconds'):
        times = [row[name] for row in rows if row[name] is not None]
        mean[name] = max(times, default=None)
    return mean


def aligned(rows: ListLike[ListLike[str]]) -> str:
    """Join cells to lines, the first column flush left and the others right."""
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    return '\n'.join(
        '  '.join(
            cell.ljust(width) if column == 0 else cell.rjust(width)
            for column, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    )


def _cell(value: float | None, digits: int) -> str:
    return '-' if value is None else f'{value:.{digits}f}'


def _time(value: float | None, never: int) -> str:
    """Return the longest time, and how many never came."""
    return _cell(value, 2) + (f' ({never} never)' if never else '')


_COLUMNS: dict[str, Callable[[Mapping[str, Any]], str]] = {
    'frames': lambda row: str(row['frames']),
    'J': lambda row: _cell(row['J'], 4),
    'F': lambda row: _cell(row['F'], 4),
    'error %': lambda row: _cell(row['error_rate'], 2),
    'image %': lambda row: _cell(row['error_rate_image'], 2),
    'box IoU': lambda row: _cell(row['box_iou'], 3),
    'tracked': lambda row: _cell(row['tracked']['box_iou'], 3),
    'placed': lambda row: _cell(row['placed']['box_iou'], 3),
    'matched': lambda row: _cell(row['matched']['box_iou'], 3),
    'lost': lambda row: str(row['lost_frames']),
    'ms': lambda row: _cell(row['ms_per_frame']['total'], 1),
    'fps': lambda row: _cell(row['fps'], 1),
}
_TRACKING_COLUMNS: dict[str, Callable[[Mapping[str, Any]], str]] = {
    'people': lambda row: str(len(row['people'])) if 'people' in row else '',
    'J': lambda row: _cell(row['J'], 4),
    'one id': lambda row: _cell(row['J_one_id'], 4),
    'box IoU': lambda row: _cell(row['box_iou'], 3),
    'centre': lambda row: _cell(row['centre_error'], 3),
    'lost': lambda row: str(row['lost_frames']),
    'switches': lambda row: str(row['id_switches']),
    'shared': lambda row: str(row['shared_ids']),
    'MOTA': lambda row: _cell(row['mota'], 3),
    'IDF1': lambda row: _cell(row['idf1'], 3),
    'lock s': lambda row: _time(row['lock_seconds'], row['never_locked']),
    'back s': lambda row: _time(row['recovery_seconds'], row['never_recovered']),
    'false': lambda row: str(row['false_slots']),
}


def table(report: Mapping[str, Any]) -> str:
    """Return the report as an aligned table, one line per sequence and one for the mean."""
    warm = report.get('warm')
    rows = [['sequence', *_COLUMNS, *(('warm J', 'J0') if warm else ())]]
    for name, numbers in [*report['sequences'].items(), ('mean', report['mean'])]:
        rows.append([name, *(cell(numbers) for cell in _COLUMNS.values())])
        if warm:
            scores = warm if name == 'mean' else warm['per_sequence'][name]
            rows[-1] += [_cell(scores[key], 4) for key in ('J', 'J0')]
    return aligned(rows)


def tracking_table(report: Mapping[str, Any]) -> str:
    """Return how people were followed as an aligned table, one line per sequence and the mean."""
    known = 'mota' in report['mean']['tracking']
    columns = {k: v for k, v in _TRACKING_COLUMNS.items() if known or k not in ('MOTA', 'IDF1')}
    rows = [['tracking', *columns]]
    for name, numbers in [*report['sequences'].items(), ('mean', report['mean'])]:
        rows.append([name, *(cell(numbers['tracking']) for cell in columns.values())])
    return aligned(rows) + ('' if known else f'\n({MISSING})')


def place_table(report: Mapping[str, Any], sequences: Iterable[Sequence]) -> str:
    """Return means over places by what ``sequence.yaml`` says; empty if none says ``place``."""
    groups: dict[str, dict[str, list[dict[str, Any]]]] = {}
    for each in sequences:
        kind, camera = (str(each.about.get(key, '?')) for key in ('kind', 'camera'))
        for group in (f'{kind}, {camera} camera', kind, 'all'):
            places = groups.setdefault(group, {})
            place = str(each.about.get('place', each.name))
            places.setdefault(place, []).append(report['sequences'][each.name])
    if not any('place' in each.about for each in sequences):
        return ''
    columns = ('J', 'error %', 'box IoU', *BOXES)
    alone = ['map J'] if 'map_J' in report['mean'] else []
    rows = [['by places', 'clips', 'places', *columns, 'collapsed %', *alone]]
    for group, places in sorted(groups.items(), key=lambda item: (item[0] == 'all', item[0])):
        alike = [{str(number): row for number, row in enumerate(each)} for each in places.values()]
        mean = mean_of({str(number): mean_of(each) for number, each in enumerate(alike)})
        cells = [_COLUMNS[name](mean) for name in columns]
        count = str(sum(map(len, places.values())))
        cells.append(_cell(100 * (mean['collapsed'] or 0), 1))
        rows.append([group, count, str(len(places)), *cells])
        if alone:
            rows[-1].append(_cell(mean['map_J'], 4))
    return aligned(rows)


def write_json(path: Path, report: Mapping[str, Any]) -> None:
    """Write a report."""
    with writing(path):
        write_file(path, (json.dumps(report, indent=2) + '\n').encode())


def write_image(path: Path, image: Image) -> None:
    """Write an image file, making its folder."""
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
    write_picture(path, image)


def write_figure(path: Path, figure: Figure) -> None:
    """Write a figure of matplotlib as PNG that says that it is from here, making its folder."""
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        data = io.BytesIO()
        figure.savefig(data, format='png', metadata=SAYS)
        write_file(path, data.getvalue())


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

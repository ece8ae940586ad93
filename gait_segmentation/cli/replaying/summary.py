# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One table of all walks in all inputs, from what their bags say of them."""

from __future__ import annotations

import csv
import io
import sys
from collections.abc import Iterable
from pathlib import Path

from gait_segmentation.cli.replaying.bag_output import BagOutput
from gait_segmentation.cli.replaying.job import Job
from gait_segmentation.cli.replaying.walks import OpenGaitOutput
from gait_segmentation.errors import SequenceError
from gait_segmentation.files.output_files import write_file

__all__ = ['COLUMNS', 'check_summary', 'write_summary']

COLUMNS = {
    'input': 'string',
    'person': 'int64',
    'walk': 'string',
    'frames': 'int64',
    'direction_rad': 'double',
    'cadence_steps_per_min': 'double',
    'speed_heights_per_s': 'double',
    'confidence': 'double',
    'silhouettes': 'string',
}
"""With their types in Parquet; a row is a walk."""

_HEAD = ','.join(COLUMNS) + '\n'


def check_summary(path: Path) -> None:
    """
    Refuse a place where there is something else than such a table.

    :raises ModuleNotFoundError: if Parquet is asked for and pyarrow is not installed.
    :raises SequenceError: if anything is there that this has not made.
    """
    own = not path.exists()
    if path.suffix == '.parquet':
        from pyarrow import ArrowInvalid, parquet

        if path.is_file():
            try:
                own = parquet.read_schema(path).names == list(COLUMNS)
            except ArrowInvalid:
                own = False
    elif path.is_file():
        own = path.read_bytes()[: len(_HEAD)] in (b'', _HEAD.encode())
    if not own:
        raise SequenceError(
            f'{path} was not made by gait_replay and is not replaced; remove it or choose another '
            'place'
        )


def write_summary(path: Path, jobs: Iterable[Job]) -> None:
    """
    Write the table over all bags that are there.

    :raises OSError: if it cannot be written.
    """
    rows = []
    for job in jobs:
        walks = BagOutput.walks(job.bag)
        if walks is None and job.bag.exists():
            print(
                f'gait_replay: {job.bag} says nothing of walks and is left out of {path}; '
                '--force makes it anew',
                file=sys.stderr,
            )
        for walk in walks or ():
            places = (
                path / kind.place_of(path.name, walk)
                for kind, path in job.outputs.items()
                if issubclass(kind, OpenGaitOutput)
            )
            found = next((str(place) for place in places if place.is_file()), '')
            rows.append({'input': str(job.input), **vars(walk), 'silhouettes': found})
    path.parent.mkdir(parents=True, exist_ok=True)
    write_file(path, _parquet(rows) if path.suffix == '.parquet' else _csv(rows))


def _csv(rows: list[dict[str, object]]) -> bytes:
    text = io.StringIO(newline='')
    table = csv.DictWriter(text, COLUMNS, lineterminator='\n')
    table.writeheader()
    table.writerows(rows)
    return text.getvalue().encode()


def _parquet(rows: list[dict[str, object]]) -> bytes:
    import pyarrow
    from pyarrow import parquet

    schema = pyarrow.schema([pyarrow.field(name, kind) for name, kind in COLUMNS.items()])
    file = io.BytesIO()
    parquet.write_table(pyarrow.Table.from_pylist(rows, schema), file)
    return file.getvalue()

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""gait_replay --summary."""

from __future__ import annotations

import csv
import pickle
from pathlib import Path

import pytest
import yaml

from gait_segmentation.cli.replay import main
from gait_segmentation.cli.replaying.walks import SUMMARY_COLUMNS
from test.cli.conftest import FRAMES


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline='') as file:
        return list(csv.DictReader(file))


def test_every_walk_has_a_row_that_leads_to_its_silhouettes(
    given: list[str], folder: Path, tmp_path: Path
) -> None:
    table = tmp_path / 'new/walks.csv'
    wanted = ['--opengait', str(tmp_path / 'gait')]
    assert main([*given, *wanted, '--summary', str(table)]) == 0
    (row,) = rows(table)
    assert tuple(row) == tuple(SUMMARY_COLUMNS)
    assert row['input'] == str(folder / 'walk')
    # All but the one that cannot be read.
    assert int(row['frames']) == FRAMES - 1
    assert len(pickle.loads(Path(row['silhouettes']).read_bytes())) == FRAMES - 1
    assert 0 < float(row['cadence_steps_per_min']) < 300


def test_what_was_done_before_is_in_it_and_a_table_is_replaced(
    given: list[str], tmp_path: Path, capsys
) -> None:
    table = tmp_path / 'walks.csv'
    assert main(given) == 0
    for _ in range(2):
        assert main([*given, '--summary', str(table)]) == 0
        assert 'done before' in capsys.readouterr().out
        (row,) = rows(table)
        assert row['silhouettes'] == ''


def test_a_bag_that_says_nothing_of_walks_is_told(
    given: list[str], tmp_path: Path, capsys
) -> None:
    assert main(given) == 0
    metadata = tmp_path / 'out/walk/metadata.yaml'
    about = yaml.safe_load(metadata.read_text())
    del about['rosbag2_bagfile_information']['custom_data']['walks']
    metadata.write_text(yaml.safe_dump(about))
    assert main([*given, '--summary', str(tmp_path / 'walks.csv')]) == 0
    assert 'walk says nothing of walks and is left out of the summary' in capsys.readouterr().err
    assert rows(tmp_path / 'walks.csv') == []


@pytest.mark.parametrize(
    ('name', 'reason'),
    [
        ('letter.csv', 'was not made by gait_replay and is not replaced'),
        ('other.csv', 'is the input'),
    ],
)
def test_nothing_else_is_replaced(
    given: list[str], tmp_path: Path, capsys, name: str, reason: str
) -> None:
    (tmp_path / 'letter.csv').write_text('dear')
    given = [*given, '--csv', str(tmp_path / 'other.csv')]
    assert main([*given, '--summary', str(tmp_path / name)]) == 2
    assert reason in capsys.readouterr().err
    assert (tmp_path / 'letter.csv').read_text() == 'dear'
    assert not (tmp_path / 'out').exists()

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import csv
import math
import pickle
from pathlib import Path

import numpy as np
import pytest
import yaml

from gait_segmentation.cli.replay import main
from gait_segmentation.cli.replaying.walks import (
    SUMMARY_COLUMNS,
    OpenGaitOutput,
    Walks,
    normalised,
)
from test.cli.conftest import FRAMES
from test.cli.replaying.results import replayed


def figure(left: int, width: int, top: int = 20, height: int = 128) -> np.ndarray:
    mask = np.zeros((200, 300), np.uint8)
    mask[top : top + height, left : left + width] = 255
    return mask


def test_a_silhouette_fills_the_height_and_stands_in_the_middle() -> None:
    silhouette = normalised(figure(100, 40))
    expected = np.zeros((64, 64), np.uint8)
    expected[:, 22:42] = 255
    assert silhouette.dtype == np.uint8
    # The centre is a whole column, and cubic interpolation rings at edges.
    assert abs(silhouette.astype(int) - expected).max(axis=0)[24:40].max() == 0
    assert (silhouette > 127).sum(axis=1).tolist() == [20] * 64
    # At the border the rest is empty, and wide ones are cut off.
    for left in (0, 260):
        assert abs(int((normalised(figure(left, 40)) > 127).sum()) - 20 * 64) <= 64
    assert (normalised(figure(0, 300)) > 127).all()


def test_walks_are_written_by_person_and_direction(tmp_path: Path) -> None:
    output = OpenGaitOutput(tmp_path / 'walk')
    for index in range(6):
        people = [(3, figure(10 * index, 40), math.pi - 0.1)]
        if index < 4:
            people.append((4, figure(200, 40), 0.0))
        output.add(*replayed(index, people))
    output.close(complete=True)
    (file,) = (tmp_path / 'walk').rglob('*.*')
    assert file == tmp_path / 'walk/person-003/180/180.pkl'
    walk = pickle.loads(file.read_bytes())
    assert (walk.shape, walk.dtype) == ((6, 64, 64), np.uint8)
    assert [p.name for p in tmp_path.iterdir()] == ['walk']


def test_a_walk_has_its_direction_cadence_and_confidence() -> None:
    walks = Walks()
    for index in range(40):
        # Averaged on the circle.
        azimuth = math.pi - 0.3 if index % 2 else 0.1 - math.pi
        walks.add(replayed(index, [(3, figure(4 * index, 40), azimuth)]).result)
    (walk,) = walks.all()
    assert (walk.person, walk.walk, walk.frames) == (3, '180', 40)
    assert walk.direction_rad == pytest.approx(math.pi - 0.1, abs=1e-4)
    assert walk.cadence_steps_per_min == pytest.approx(120 * 0.9)
    assert walk.confidence == pytest.approx(0.7)


def test_short_walks_and_what_is_hardly_seen_are_left_out() -> None:
    walks = Walks()
    for index in range(40):
        if index < 4:
            walks.add(replayed(index, [(3, figure(4 * index, 40), 0.0)]).result)
        walks.add(replayed(index, [(4, figure(0, 3, height=13), 0.0)]).result)
        walks.add(replayed(index, [(0, np.zeros((200, 300), np.uint8), 0.0)]).result)
    assert walks.all() == []


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
    metadata = tmp_path / 'out/walk/metadata.yaml'
    about = yaml.safe_load(metadata.read_text())
    del about['rosbag2_bagfile_information']['custom_data']['walks']
    metadata.write_text(yaml.safe_dump(about))
    assert main([*given, '--summary', str(table)]) == 0
    assert 'walk says nothing of walks and is left out of the summary' in capsys.readouterr().err
    assert rows(table) == []


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


def test_a_silhouette_stands_where_most_of_it_is() -> None:
    """And not in the middle between the back and the hand of an arm that is held out."""
    mask = figure(100, 20)
    mask[60:70, 100:160] = 255
    head = np.flatnonzero(normalised(mask)[0] > 127)
    assert head.mean() == pytest.approx(31, abs=2)


@pytest.mark.parametrize(('azimuth', 'name'), [(math.pi / 2, '090'), (-math.pi / 2, '270')])
def test_walks_to_the_left_and_to_the_right_are_told_apart(azimuth: float, name: str) -> None:
    walks = Walks()
    for index in range(10):
        walks.add(replayed(index, [(3, figure(4 * index, 40), azimuth)]).result)
    assert [walk.walk for walk in walks.all()] == [name]

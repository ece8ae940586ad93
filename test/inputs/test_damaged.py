# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import HealthCheck, example, given, settings, strategies as st

from gait_segmentation.inputs import damaged
from test.inputs.bags import greys
from test.inputs.test_bag import PARTLY_READ, WRITERS

# The examples share a folder, in which each writes its file anew.
in_one_folder = settings(
    max_examples=40,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)


@pytest.fixture(scope='module', params=PARTLY_READ)
def bag(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the file of a whole bag."""
    path = WRITERS[request.param](
        tmp_path_factory.mktemp('whole') / 'walk', {'/image': greys(6), '/other': greys(3)}
    )
    return path if path.is_file() else next(p for p in path.iterdir() if p.suffix != '.yaml')


def read(path: Path, topic: str = '/image') -> tuple[list[tuple[int, bytes]], str]:
    """Return the messages before the damage, and what is said of it."""
    found = []
    try:
        found.extend(damaged.messages(path, topic))
    except damaged.BrokenError as error:
        return found, str(error)
    return found, ''


def test_whole_bags_are_read_to_the_end(bag: Path) -> None:
    found, problem = read(bag)
    assert not problem
    assert len(found) == 6
    assert [recorded_ns for recorded_ns, _ in found] == sorted(at for at, _ in found)
    assert len(read(bag, '/other')[0]) == 3
    assert damaged.topics(bag) == dict.fromkeys(('/image', '/other'), 'sensor_msgs/msg/Image')


@in_one_folder
@given(share=st.floats(0.0, 0.999))
def test_wherever_a_file_is_cut_its_front_comes_out(
    bag: Path, tmp_path: Path, share: float
) -> None:
    whole, _ = read(bag)
    data = bag.read_bytes()
    cut = tmp_path / bag.name
    cut.write_bytes(data[: int(share * len(data))])
    found, problem = read(cut)
    assert found == whole[: len(found)]
    assert problem.startswith(f'{cut.name}: ') if problem else len(found) == len(whole)


@in_one_folder
@given(at=st.floats(0.05, 0.999), junk=st.binary(min_size=1, max_size=64))
@example(at=0.06923632248505321, junk=b'\x01')
@example(at=0.7810642431225122, junk=b'\x00')
def test_junk_in_a_file_is_an_end_and_no_other_error(
    bag: Path, tmp_path: Path, at: float, junk: bytes
) -> None:
    data = bytearray(bag.read_bytes())
    start = int(at * len(data))
    data[start : start + len(junk)] = junk
    spoilt = tmp_path / bag.name
    spoilt.write_bytes(data)
    read(spoilt)
    damaged.topics(spoilt)

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Several inputs at a time, in processes and on a Dask cluster."""

import gc
import logging
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gait_segmentation.cli import jobs
from gait_segmentation.cli.outputs import BagOutput
from gait_segmentation.cli.replay import main
from gait_segmentation.detector.detection import Detection
from gait_segmentation.detector.networks import DetectorConfig, Networks
from gait_segmentation.geometry import Box
from test.inputs.bags import compressed_fields, stamp, write_bag2
from test.walkers import clip

ROOT = Path(__file__).parents[2]
TIMEOUT_S = 300.0

# A client that was interrupted says seconds later, in the midst of other tests, that it is closed.
logging.getLogger('distributed.client').addFilter(lambda record: False)


def wait_until(true: Callable[[], object]) -> None:
    deadline = time.monotonic() + TIMEOUT_S
    while not true() and time.monotonic() < deadline:
        time.sleep(0.01)


def files(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob('*')
        if path.is_file()
    }


@pytest.fixture(scope='module')
def bags(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """Return two bags that take a while."""
    path = tmp_path_factory.mktemp('in')
    frames = [compressed_fields(clip()[0].image, stamp(index), 'jpeg') for index in range(600)]
    one = write_bag2(path / 'one', {'/image': frames})
    return [str(one), str(shutil.copytree(one, path / 'two'))]


@pytest.fixture
def two(given: list[str], bags: list[str]) -> list[str]:
    """Return arguments that replay two bags; networks would only be loaded once a process."""
    return [*bags, *given[1:], '--detector', 'none']


@pytest.fixture(scope='module')
def cluster() -> Iterator[Any]:
    """Return a cluster of Dask with one worker, a process."""
    distributed = pytest.importorskip('distributed', reason='needs the extra archive')
    made = distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=':0')
    yield made
    # On a busy machine Dask may not see its worker end; that is not what is tested.
    with suppress(TimeoutError, RuntimeError, UnboundLocalError):
        made.close()


def children() -> set[int]:
    """Return the numbers of the processes that multiprocessing has spawned here."""
    command = ['pgrep', '-P', str(os.getpid()), '-f', 'spawn_main']
    return {int(each) for each in subprocess.run(command, capture_output=True).stdout.split()}


@pytest.fixture
def workers() -> Callable[[], set[int]]:
    """Return what gives the numbers of the workers that were started since, as by --jobs."""
    there = children()
    return lambda: children() - there


def when_begun(tmp_path: Path, act: Callable[[], object], inputs: int = 1) -> None:
    """Do something once the outputs of so many inputs grow."""

    def wait() -> None:
        wait_until(lambda: len(list(tmp_path.glob('out/*.partial'))) >= inputs)
        act()

    # Or it outlives a test that fails.
    threading.Thread(target=wait, daemon=True).start()


def test_outputs_and_codes_are_the_same_wherever_inputs_are_replayed(
    given: list[str], folder: Path, tmp_path: Path, capsys, monkeypatch, cluster: Any
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ('walk', 'cut'):
        shutil.copytree(folder / 'walk', name)
    bag = Path('cut/walk.mcap')
    data = bytearray(bag.read_bytes())
    data[len(data) // 2 : len(data) * 3 // 4] = b'\xff' * (len(data) * 3 // 4 - len(data) // 2)
    bag.write_bytes(data)
    command = ['walk', 'cut', '--detector', 'none', *given[1:-1]]
    found = []
    ways = {'here': [], 'jobs': ['--jobs', '2'], 'dask': ['--dask', cluster.scheduler_address]}
    for out, more in ways.items():
        assert main([*command, out, '--masks', f'{out}/masks', *more]) == 1
        said = capsys.readouterr()
        assert re.search(r'cut is damaged: (\d+) of \d+ images .*mcap recover FILE', said.err)
        assert f'see {out}' in said.out
        found.append(files(tmp_path / out))
        assert main(['missing.mp4', *command, out, '--masks', f'{out}/masks', *more]) == 2
        assert capsys.readouterr().out.count('done before') == 2
    assert found[0] == found[1] == found[2] != {}


def test_of_two_commands_into_the_same_outputs_one_is_refused(
    two: list[str], tmp_path: Path, capfd
) -> None:
    out, command = tmp_path / 'out/one', [two[0], *two[2:], '--count', '2']
    first = BagOutput(out)
    assert main(command) == 2
    assert f'{out} is being made by another command' in capfd.readouterr().err
    first.close(complete=True)
    assert [path.name for path in out.parent.iterdir()] == ['one']
    assert main([*command, '--force']) == 0


@pytest.mark.parametrize(
    ('tracks', 'said'),
    [('a.csv', 'is'), ('link.csv', 'is'), ('out/one/a.txt', 'lies in')],
)
def test_two_outputs_at_the_same_place_are_refused_before_anything_is_made(
    tracks: str, said: str, two: list[str], tmp_path: Path, capsys, monkeypatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path('link.csv').symlink_to('a.csv')
    assert main([two[0], *two[2:], '--csv', 'a.csv', '--tracks', tracks]) == 2
    assert f'error: --tracks {tracks} {said} the output ' in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ['link.csv']


def test_of_a_killed_worker_it_is_told_and_the_same_command_continues(
    two: list[str], tmp_path: Path, workers: Callable[[], set[int]], capfd
) -> None:
    when_begun(tmp_path, lambda: [os.kill(each, signal.SIGKILL) for each in workers()])
    assert main([*two, '--jobs', '2']) == 2
    said = capfd.readouterr().err
    assert 'a worker failed, the same command goes on (KilledWorker: ' in said
    assert 'Traceback' not in said
    assert main([*two, '--count', '2']) == 0
    assert sorted(path.name for path in (tmp_path / 'out').iterdir()) == ['one', 'two']


def test_workers_end_with_a_parent_that_is_killed(two: list[str], tmp_path: Path) -> None:
    process = subprocess.Popen(
        [sys.executable, '-m', 'gait_segmentation.cli.replay', *two, '--jobs', '2'],
        cwd=ROOT,
        stderr=subprocess.PIPE,
        text=True,
    )
    wait_until(lambda: list(tmp_path.glob('out/*.partial')) or process.poll() is not None)
    process.kill()
    # Until all have closed it.
    _, said = process.communicate(timeout=TIMEOUT_S)
    assert process.returncode == -signal.SIGKILL
    assert 'Traceback' not in said


def test_ctrl_c_ends_the_workers(
    two: list[str], tmp_path: Path, workers: Callable[[], set[int]], capfd
) -> None:
    # As a terminal does, to all of them.
    when_begun(
        tmp_path,
        lambda: [os.kill(each, signal.SIGINT) for each in (*workers(), os.getpid())],
        inputs=2,
    )
    assert main([*two, '--jobs', '2']) == 130
    said = capfd.readouterr().err
    assert all(f'{each}: interrupted' in said for each in two[:2])
    assert 'Traceback' not in said
    wait_until(lambda: not workers())
    assert not workers()


def test_ctrl_c_breaks_off_what_a_cluster_does(
    two: list[str], tmp_path: Path, cluster: Any, capfd
) -> None:
    when_begun(tmp_path, lambda: os.kill(os.getpid(), signal.SIGINT))
    assert main([*two, '--dask', cluster.scheduler_address]) == 130
    assert [path.suffix for path in (tmp_path / 'out').iterdir()] == ['.partial']
    assert 'interrupted before 1 of the inputs' in capfd.readouterr().err


def test_a_worker_without_the_package_is_told(
    two: list[str], tmp_path: Path, cluster: Any, capfd
) -> None:
    hide = f'import sys; sys.modules[{jobs.__name__!r}] = None'
    with cluster.get_client() as client:
        client.run(exec, hide)
        assert main([*two, '--dask', cluster.scheduler_address]) == 2
        client.run(exec, f'import sys; sys.modules.pop({jobs.__name__!r})')
    assert (
        f'error: --dask {cluster.scheduler_address}: import of {jobs.__name__}'
        in capfd.readouterr().err
    )
    assert not (tmp_path / 'out').exists()


def test_a_cluster_that_goes_is_an_error(
    two: list[str], tmp_path: Path, cluster: Any, capfd
) -> None:
    when_begun(tmp_path, cluster.close)
    assert main([*two, '--dask', cluster.scheduler_address]) == 2
    said = capfd.readouterr().err
    assert said.count('a worker failed, the same command goes on') == 2
    assert 'Traceback' not in said


@pytest.mark.parametrize(
    ('address', 'reason'),
    [
        ('localhost', 'error: --dask localhost: missing port number'),
        ('ftp://localhost:1', 'unknown address scheme'),
        ('', 'distributed is not installed: pip install'),
    ],
)
def test_without_a_cluster_it_is_told_what_is_missing(
    address: str, reason: str, given: list[str], tmp_path: Path, capsys, monkeypatch
) -> None:
    if address:
        pytest.importorskip('distributed', reason='needs the extra archive')
    else:
        monkeypatch.setitem(sys.modules, 'distributed', None)
    assert main([*given, '--dask', address or 'tcp://host:8786']) == 2
    # What is left of a client would close while the next one starts, and both wait for ever.
    gc.collect()
    assert reason in capsys.readouterr().err
    assert not (tmp_path / 'out').exists()


def test_the_best_score_of_all_looks_is_told(monkeypatch) -> None:
    scores = iter((0.2, 0.7, 0.3))
    box = Box(0, 0, 20, 50)
    networks = Networks(lambda image: [Detection(box, next(scores, 0.1))])
    monkeypatch.setattr(jobs, 'open_networks', lambda *_: networks)
    looked = jobs._Looked(DetectorConfig())
    for _ in range(3):
        looked.networks.people(np.zeros((60, 80, 3), np.uint8))
    assert looked.summary() == 'the detector (people) looked 3 times, at best with a score of 0.70'

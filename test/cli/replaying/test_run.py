# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Several inputs in processes, and on a Dask cluster: a stand-in, and a real one if there is."""

from __future__ import annotations

import multiprocessing
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from gait_segmentation.cli.replay import main
from gait_segmentation.cli.replaying import run
from gait_segmentation.cli.replaying.run import Job, Report, _until_interrupted
from gait_segmentation.gait_model import TemplateBank

ROOT = Path(__file__).parents[3]
TIMEOUT_S = 300.0
ADDRESS = ['--dask', 'tcp://scheduler:8786']
pytestmark = pytest.mark.usefixtures('signal_handlers')


def wait_until(true: Callable[[], object], timeout_s: float = TIMEOUT_S) -> None:
    deadline = time.monotonic() + timeout_s
    while not true() and time.monotonic() < deadline:
        time.sleep(0.01)


def files(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob('*')
        if path.is_file()
    }


def test_the_second_signal_interrupts_and_after_the_context_all_is_as_before() -> None:
    before = signal.getsignal(signal.SIGTERM)
    with _until_interrupted() as stop:
        signal.raise_signal(signal.SIGTERM)
        assert stop.is_set()
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGTERM)
    assert signal.getsignal(signal.SIGTERM) == before


def test_what_nohup_has_begun_survives_its_terminal() -> None:
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    with _until_interrupted() as stop:
        signal.raise_signal(signal.SIGHUP)
        assert not stop.is_set()


@pytest.fixture
def two(given: list[str], folder: Path, tmp_path: Path) -> list[str]:
    """Return arguments that replay two bags."""
    return [given[0], str(shutil.copytree(folder / 'walk', tmp_path / 'second')), *given[1:]]


def test_of_a_killed_worker_it_is_told_and_the_same_command_continues(
    two: list[str], tmp_path: Path, capfd
) -> None:
    command = [*two, '--jobs', '2']

    def kill() -> None:
        wait_until((tmp_path / 'out/walk.partial').exists)
        for each in multiprocessing.active_children():
            if 'Manager' not in each.name:
                os.kill(each.pid or 0, signal.SIGKILL)

    killer = threading.Thread(target=kill)
    killer.start()
    assert main(command) == 2
    killer.join()
    said = capfd.readouterr().err
    assert 'walk: a process was killed, as when memory runs out: the same command' in said
    assert main(command) == 0
    assert sorted(path.name for path in (tmp_path / 'out').iterdir()) == ['second', 'walk']


def state_of(process: Path) -> tuple[str, int]:
    """Return the state and the parent of a process; one that has ended is a zombie."""
    try:
        state, parent = (process / 'stat').read_text().rsplit(')', 1)[1].split()[:2]
    except OSError:
        return 'Z', 0
    return state, int(parent)


@pytest.mark.parametrize(('number', 'code'), [(signal.SIGKILL, -9), (signal.SIGINT, 130)])
def test_workers_end_with_their_parent(
    number: signal.Signals, code: int, two: list[str], tmp_path: Path
) -> None:
    process = subprocess.Popen(
        [sys.executable, '-m', 'gait_segmentation.cli.replay', *two, '--jobs', '2'],
        cwd=ROOT,
        stderr=subprocess.DEVNULL,
    )
    try:
        wait_until(lambda: list(tmp_path.glob('out/*.partial')) or process.poll() is not None)
        found = list(Path('/proc').glob('[0-9]*'))
        children = [each for each in found if state_of(each)[1] == process.pid]
        process.send_signal(number)
        # Too short for a signal to be of any use, unless it has come before the last frame.
        assert process.wait(TIMEOUT_S) in {code, 0} - ({0} if code < 0 else set())
    finally:
        process.kill()
        process.wait()
    assert children
    wait_until(lambda: all(state_of(child)[0] == 'Z' for child in children))
    assert all(state_of(child)[0] == 'Z' for child in children)


class KilledWorker(Exception):  # noqa: N818
    allowed_failures = 3


class StandIn:
    """A scheduler with a thread as its only worker, whose folder is another."""

    def __init__(self, address: str, **_: Any) -> None:
        self.pool = ThreadPoolExecutor(1)

    def __enter__(self) -> StandIn:
        return self

    def __exit__(self, *_: object) -> None:
        self.pool.shutdown()

    def nthreads(self) -> dict[str, int]:
        return {'worker': 1}

    def get_executor(self, **_: Any) -> StandIn:
        return self

    def submit(self, task: Any, job: Any, *more: Any) -> Future:
        if 'killer' in str(job.input):
            task = self.die
        return self.pool.submit(task, job, *more)

    def die(self, *_: Any) -> None:
        raise KilledWorker


@pytest.fixture
def stand_in(monkeypatch) -> None:
    module = SimpleNamespace(Client=StandIn, Event=lambda client: threading.Event())
    monkeypatch.setitem(sys.modules, 'distributed', module)


@pytest.mark.usefixtures('stand_in')
def test_outputs_and_codes_are_those_of_jobs(
    given: list[str], folder: Path, tmp_path: Path, capsys, monkeypatch
) -> None:
    monkeypatch.chdir(tmp_path)
    shutil.copytree(folder / 'walk', 'walk')
    shutil.copytree(folder / 'walk', 'cut')
    bag = Path('cut/walk.mcap')
    data = bytearray(bag.read_bytes())
    data[len(data) // 2 : len(data) * 3 // 4] = b'\xff' * (len(data) * 3 // 4 - len(data) // 2)
    bag.write_bytes(data)
    command = ['walk', 'cut', *given[1:-1]]
    found = []
    for out, more in ('one', []), ('two', ADDRESS):
        assert main([*command, out, '--masks', f'{out}/masks', *more]) == 1
        said = capsys.readouterr()
        assert 'cut is damaged' in said.err
        assert f'see {out}' in said.out
        found.append(files(tmp_path / out))
    assert found[0] == found[1] != {}
    assert main([*command, 'two', '--masks', 'two/masks', *ADDRESS]) == 0
    assert capsys.readouterr().out.count('done before') == 2
    assert main(['missing.mp4', *command, 'two', *ADDRESS]) == 2


@pytest.mark.usefixtures('stand_in')
def test_what_kills_workers_is_told_and_the_rest_is_done(
    given: list[str], folder: Path, tmp_path: Path, capsys
) -> None:
    killer = tmp_path / 'killer'
    shutil.copytree(folder / 'walk', killer)
    assert main([str(killer), *given, *ADDRESS]) == 2
    assert f'error: {killer}: 4 workers died' in capsys.readouterr().err
    assert (tmp_path / 'out/walk/metadata.yaml').exists()


@pytest.mark.usefixtures('stand_in')
def test_an_interruption_begins_nothing_more(two: list[str], tmp_path: Path, monkeypatch) -> None:
    whole = run.replay

    def interrupted(job: Job, bank: TemplateBank, stop: Any, **named: Any) -> Report:
        os.kill(os.getpid(), signal.SIGINT)
        return whole(job, bank, lambda: came(stop), **named)

    def came(stop: Any) -> bool:
        """Wait at the first frame until the interruption has come through."""
        wait_until(stop, 60.0)
        assert stop()
        return True

    monkeypatch.setattr(run, '_ASK_S', 0.0)
    monkeypatch.setattr(run, 'replay', interrupted)
    assert main([*two, *ADDRESS]) == 130
    assert [path.name for path in (tmp_path / 'out').iterdir()] == ['walk.partial']


@pytest.mark.usefixtures('stand_in')
def test_one_interruption_is_enough_where_there_are_no_workers(
    two: list[str], monkeypatch, capsys
) -> None:
    monkeypatch.setattr(StandIn, 'nthreads', lambda _: {})
    monkeypatch.setattr(StandIn, 'submit', lambda *_: Future())
    presses = [threading.Timer(s, os.kill, (os.getpid(), signal.SIGINT)) for s in (0.5, 30.0)]
    for each in presses:
        each.start()
    assert main([*two, *ADDRESS]) == 130
    assert presses[1].is_alive()
    presses[1].cancel()
    assert 'has no workers yet' in capsys.readouterr().err


def test_without_dask_it_is_told_what_to_install(
    given: list[str], tmp_path: Path, capsys, monkeypatch
) -> None:
    monkeypatch.setitem(sys.modules, 'distributed', None)
    assert main([*given, *ADDRESS]) == 2
    assert "distributed is not installed: pip install distributed, or '.[archive]'" in (
        capsys.readouterr().err
    )
    assert not (tmp_path / 'out').exists()


@pytest.mark.filterwarnings('ignore::ResourceWarning')
def test_a_real_cluster(two: list[str], tmp_path: Path, capsys) -> None:
    distributed = pytest.importorskip('distributed', reason='needs the extra archive')
    import dask

    command = two[:-1]
    assert main([*command, str(tmp_path / 'one'), '--jobs', '2']) == 0
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=False, dashboard_address=':0'
    ) as cluster:
        address = cluster.scheduler_address
        assert main([*command, str(tmp_path / 'two'), '--dask', address]) == 0
    assert files(tmp_path / 'one') == files(tmp_path / 'two')
    with dask.config.set({'distributed.comm.timeouts.connect': '1s'}):
        assert main([*command, str(tmp_path / 'new'), '--dask', 'tcp://127.0.0.1:9']) == 2
    assert '--dask tcp://127.0.0.1:9: there is no Dask scheduler' in capsys.readouterr().err

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""gait_replay --dask: with a stand-in for the cluster, and on a real one where there is Dask."""

from __future__ import annotations

import os
import shutil
import signal
import sys
import threading
import time
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from gait_segmentation import commands
from gait_segmentation.cli.replay import main
from gait_segmentation.cli.replaying.job import Job, Report
from gait_segmentation.gait_model import TemplateBank

CLUSTER = 'gait_segmentation.cli.replaying.cluster'
ADDRESS = ['--dask', 'tcp://scheduler:8786']
pytestmark = pytest.mark.usefixtures('signal_handlers')


class KilledWorker(Exception):  # noqa: N818
    allowed_failures = 3


class StandIn:
    """A scheduler with a thread as its only worker, whose folder is another."""

    workers = 1

    def __init__(self, address: str, **_: Any) -> None:
        self.pool = ThreadPoolExecutor(1)

    def __enter__(self) -> StandIn:
        return self

    def __exit__(self, *_: object) -> None:
        self.pool.shutdown()

    def nthreads(self) -> dict[str, int]:
        return dict.fromkeys(range(self.workers), 1)

    def get_executor(self, **_: Any) -> StandIn:
        return self

    def submit(self, task: Any, job: Any, *more: Any, **named: Any) -> Future:
        if 'killer' in str(job.input):
            task = self.die
        return self.pool.submit(task, job, *more, **named)

    def die(self, *_: Any, **__: Any) -> None:
        raise KilledWorker


def with_distributed(module: Any, monkeypatch) -> None:
    """Have the module of the package that uses Dask imported anew."""
    monkeypatch.setitem(sys.modules, 'distributed', module)
    monkeypatch.delitem(sys.modules, CLUSTER, raising=False)
    monkeypatch.delattr(CLUSTER, raising=False)


@pytest.fixture
def stand_in(monkeypatch) -> type[StandIn]:
    module = SimpleNamespace(
        Client=StandIn, KilledWorker=KilledWorker, Event=lambda client: threading.Event()
    )
    with_distributed(module, monkeypatch)
    return StandIn


def files(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob('*')
        if path.is_file()
    }


def test_outputs_and_codes_are_those_of_jobs(
    given: list[str], folder: Path, tmp_path: Path, capsys, monkeypatch, stand_in
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


def test_what_kills_workers_is_told_and_the_rest_is_done(
    given: list[str], folder: Path, tmp_path: Path, capsys, stand_in
) -> None:
    killer = tmp_path / 'killer'
    shutil.copytree(folder / 'walk', killer)
    assert main([str(killer), *given, *ADDRESS]) == 2
    assert f'error: {killer}: 4 workers died of it' in capsys.readouterr().err
    assert (tmp_path / 'out/walk/metadata.yaml').exists()


def test_an_interruption_begins_nothing_more(
    given: list[str], folder: Path, tmp_path: Path, monkeypatch, stand_in
) -> None:
    from gait_segmentation.cli.replaying import cluster

    whole = cluster.replay

    def interrupted(job: Job, bank: TemplateBank, stop: Any, **named: Any) -> Report:
        os.kill(os.getpid(), signal.SIGINT)
        return whole(job, bank, lambda: wait(stop), **named)

    second = shutil.copytree(folder / 'walk', tmp_path / 'second')
    monkeypatch.setattr(cluster, '_ASK_S', 0.0)
    monkeypatch.setattr(cluster, 'replay', interrupted)
    assert main([given[0], str(second), *given[1:], *ADDRESS]) == 130
    assert [path.name for path in (tmp_path / 'out').iterdir()] == ['walk.partial']


def wait(stop: Any) -> bool:
    """Wait at the first frame until the interruption has come through."""
    deadline = time.monotonic() + 60
    while not stop() and time.monotonic() < deadline:
        time.sleep(0.01)
    return True


def test_nobody_waits_for_a_cluster_without_workers_after_an_interruption(
    given: list[str], capsys, monkeypatch, stand_in
) -> None:
    def interrupted(*_: Any, **__: Any) -> Future:
        os.kill(os.getpid(), signal.SIGINT)
        return Future()

    monkeypatch.setattr(stand_in, 'workers', 0)
    monkeypatch.setattr(stand_in, 'submit', interrupted)
    assert main([*given, *ADDRESS]) == 130
    assert 'has no workers yet: waiting for them' in capsys.readouterr().err


def test_without_dask_it_is_told_what_to_install(
    given: list[str], tmp_path: Path, capsys, monkeypatch
) -> None:
    with_distributed(None, monkeypatch)
    monkeypatch.setattr(sys, 'argv', ['gait_replay', *given, *ADDRESS])
    assert commands.replay() == 2
    assert "distributed is not installed: pip install distributed, or '.[archive]'" in (
        capsys.readouterr().err
    )
    assert not (tmp_path / 'out').exists()


@pytest.mark.filterwarnings('ignore::ResourceWarning')
def test_a_real_cluster(given: list[str], folder: Path, tmp_path: Path, capsys) -> None:
    distributed = pytest.importorskip('distributed', reason='needs the extra archive')
    import dask

    second = shutil.copytree(folder / 'walk', tmp_path / 'second')
    command = [given[0], str(second), *given[1:-1]]
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

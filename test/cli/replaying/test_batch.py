# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from gait_segmentation.cli.replay import main
from gait_segmentation.cli.replaying import batch
from gait_segmentation.cli.replaying.batch import _until_interrupted
from gait_segmentation.cli.replaying.job import Job, Report
from gait_segmentation.pipeline import PipelineConfig
from test.inputs.bags import image_fields, stamp, write_bag2
from test.walkers import clip, small_bank

ROOT = Path(__file__).parents[3]
TIMEOUT_S = 300.0


def test_the_second_signal_interrupts_and_after_the_context_all_is_as_before() -> None:
    before = signal.getsignal(signal.SIGTERM)
    with _until_interrupted() as stop:
        signal.raise_signal(signal.SIGTERM)
        assert stop.is_set()
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGTERM)
    assert signal.getsignal(signal.SIGTERM) == before


def test_what_nohup_has_begun_survives_its_terminal() -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with _until_interrupted() as stop:
            signal.raise_signal(signal.SIGHUP)
            assert not stop.is_set()
    finally:
        signal.signal(signal.SIGHUP, before)


@pytest.fixture
def command(tmp_path: Path) -> list[str]:
    """Return arguments that replay two bags at a time."""
    small_bank().save(tmp_path / 'small.npz')
    frames = [image_fields(each.image, stamp(n)) for n, each in enumerate(clip()[:10])]
    bags = [str(write_bag2(tmp_path / name, {'/image': frames})) for name in ('one', 'two')]
    options = ['--bank', str(tmp_path / 'small.npz'), '--out', str(tmp_path / 'out')]
    return [*bags, *options, '--jobs', '2']


def wait_until(true: Callable[[], object]) -> None:
    deadline = time.monotonic() + TIMEOUT_S
    while not true() and time.monotonic() < deadline:
        time.sleep(0.01)


@pytest.mark.parametrize('name', ['one', 'two'])
@pytest.mark.usefixtures('signal_handlers')
def test_what_a_killed_worker_was_at_is_done_again(
    name: str, command: list[str], tmp_path: Path, capfd
) -> None:
    def kill() -> None:
        wait_until((tmp_path / f'out/.{name}.part').exists)
        os.kill(multiprocessing.active_children()[0].pid or 0, signal.SIGKILL)

    killer = threading.Thread(target=kill)
    killer.start()
    assert main(command) == 0
    killer.join()
    assert sorted(path.name for path in (tmp_path / 'out').iterdir()) == ['one', 'two']
    assert 'a process was killed, as when memory runs out' in capfd.readouterr().err


@pytest.mark.parametrize('killers', [[], [0], [3], [1, 2], [0, 1, 2, 3]])
@pytest.mark.parametrize('at_a_time', [2, 3, 4])
def test_an_input_that_kills_whoever_takes_it_is_reported(
    killers: list[int], at_a_time: int, monkeypatch
) -> None:
    def replayed(jobs: list[Job], _: object, processes: int, *__: object) -> dict[int, Report]:
        """Do what comes before the first that kills; of those side by side none is done."""
        kills = [int(job.input.name) in killers for job in jobs]
        first = kills.index(True) if True in kills else len(jobs)
        return {n: Report(jobs[n].input) for n in range(first - (first % processes))}

    monkeypatch.setattr(batch, '_in_processes', replayed)
    jobs = [Job(Path(str(number)), PipelineConfig(), {}) for number in range(4)]
    reports = batch._side_by_side(jobs, [None] * 4, at_a_time, False)
    assert sorted(report.input for report in reports) == [job.input for job in jobs]
    assert [int(each.input.name) for each in reports if each.error] == killers


def state_of(process: Path) -> tuple[str, int]:
    """Return the state and the parent of a process; one that has ended is a zombie."""
    try:
        state, parent = (process / 'stat').read_text().rsplit(')', 1)[1].split()[:2]
    except OSError:
        return 'Z', 0
    return state, int(parent)


def test_workers_end_with_their_parent(command: list[str], tmp_path: Path) -> None:
    process = subprocess.Popen(
        [sys.executable, '-m', 'gait_segmentation.cli.replay', *command],
        cwd=ROOT,
        stderr=subprocess.DEVNULL,
    )
    try:
        wait_until(lambda: list((tmp_path / 'out').glob('.*.part')) or process.poll() is not None)
        found = list(Path('/proc').glob('[0-9]*'))
        children = [each for each in found if state_of(each)[1] == process.pid]
    finally:
        process.kill()
        process.wait()
    assert children
    wait_until(lambda: all(state_of(child)[0] == 'Z' for child in children))
    assert all(state_of(child)[0] == 'Z' for child in children)

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The commands, interrupted while they import."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest

from gait_segmentation import commands

ROOT = Path(__file__).resolve().parents[1]
TIMEOUT_S = 300.0
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
TOOLS = ('replay', 'warm_up')
NODES = tuple(name for name in commands.__all__ if name not in TOOLS)

SCRIPT = """
import sys, time
class Slow:
    def find_spec(self, name, path=None, target=None):
        if name == 'cv2':
            print('importing', flush=True)
            # In short pieces: a signal just before a sleep is not noticed before its end.
            while True:
                time.sleep(0.05)
sys.meta_path.insert(0, Slow())
from gait_segmentation import commands
sys.exit(commands.{}())
"""


pytestmark = pytest.mark.usefixtures('signal_handlers')


@pytest.mark.parametrize('number', SIGNALS)
@pytest.mark.parametrize(
    ('name', 'code', 'text'),
    [('tracker', 0, ''), ('replay', 130, 'gait_replay: interrupted\n')],
)
def test_a_signal_during_the_imports_ends_a_command_quietly(
    number: signal.Signals, name: str, code: int, text: str
) -> None:
    with subprocess.Popen(
        [sys.executable, '-c', SCRIPT.format(name)],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout.readline() == 'importing\n'
        process.send_signal(number)
        _, said = process.communicate(timeout=TIMEOUT_S)
    assert process.returncode == code
    assert said == text


@pytest.mark.parametrize('name', ['replay', 'tracker'])
def test_arguments_that_are_no_text_are_refused(name: str, monkeypatch, capsys) -> None:
    monkeypatch.setattr(sys, 'argv', ['command', 'clip\udcff.mp4'])
    assert getattr(commands, name)() == 2
    assert (
        capsys.readouterr().err == f'gait_{name}: error: clip\ufffd.mp4 is not UTF-8: rename it\n'
    )


def test_without_ros_it_is_said_what_to_do() -> None:
    script = (
        'import sys\n'
        'class NoRos:\n'
        '    def find_spec(self, name, path=None, target=None):\n'
        "        if name.partition('.')[0] in ('rclpy', 'sensor_msgs', 'geometry_msgs'):\n"
        "            raise ModuleNotFoundError(f'No module named {name!r}', name=name)\n"
        'sys.meta_path.insert(0, NoRos())\n'
        'from gait_segmentation import commands\n'
        'sys.exit(commands.tracker())\n'
    )
    done = subprocess.run([sys.executable, '-c', script], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 2
    assert re.fullmatch(
        r'gait_tracker: error: there is no ROS 2 for this Python \(no module \w+\): source .*\n',
        done.stderr,
    )


@pytest.mark.parametrize(
    ('name', 'package', 'extra'),
    [('replay', 'tqdm', 'tools'), ('replay', 'distributed', 'archive')],
)
def test_without_what_tools_need_it_is_said_what_to_install(
    name: str, package: str, extra: str, monkeypatch, capsys
) -> None:
    def missing(*about: object) -> None:
        raise ModuleNotFoundError(f'No module named {package!r}', name=package)

    monkeypatch.setattr(sys, 'argv', [f'gait_{name}'])
    monkeypatch.setattr(commands, 'import_module', missing)
    assert getattr(commands, name)() == 2
    assert capsys.readouterr().err == (
        f'gait_{name}: error: the Python package {package} is not installed: pip install '
        f"{package}, or '.[{extra}]' for all of the {extra}\n"
    )


def test_another_module_that_is_missing_is_no_matter_of_ros(monkeypatch) -> None:
    def missing(*about: object) -> None:
        raise ModuleNotFoundError("No module named 'numba'", name='numba')

    monkeypatch.setattr(sys, 'argv', ['gait_tracker'])
    monkeypatch.setattr(commands, 'import_module', missing)
    with pytest.raises(ModuleNotFoundError, match='numba'):
        commands.tracker()


def modules(monkeypatch, main: Callable[[], int]) -> list[str]:
    """Put a module with a main function in the place of all; return which are imported."""
    module = SimpleNamespace(main=main, take_part_early=lambda: None)
    found: list[str] = []
    monkeypatch.setattr(commands, 'import_module', lambda each: found.append(each) or module)
    return found


@pytest.mark.parametrize('name', commands.__all__)
def test_every_command_runs_its_module(name: str, monkeypatch) -> None:
    def main() -> int:
        # Tools are interrupted; nodes replace the handlers themselves, without a gap.
        now = {signal.getsignal(number) for number in SIGNALS}
        assert (now == {commands._interrupt}) == (name in TOOLS)
        return 3

    monkeypatch.setattr(sys, 'argv', [f'gait_{name}'])
    found = modules(monkeypatch, main)
    assert getattr(commands, name)() == 3
    # Nobody wants to see where the interpreter was when a command had ended.
    assert {signal.getsignal(number) for number in SIGNALS} == {signal.SIG_IGN}
    assert found == (
        [f'gait_segmentation.cli.{name}']
        if name in TOOLS
        else ['gait_segmentation.ros.participant', f'gait_segmentation.nodes.{name}_node']
    )
    assert all(Path(ROOT / f'{each.replace(".", "/")}.py').is_file() for each in found)


@pytest.mark.parametrize(
    'given', [['--help'], ['image.png'], ['-r', 'a:=b'], ['--ros-args', '--', 'image.png']]
)
def test_a_node_that_may_say_something_of_its_command_line_does_not_appear(
    given: list[str], monkeypatch
) -> None:
    monkeypatch.setattr(sys, 'argv', ['gait_tracker', *given])
    found = modules(monkeypatch, lambda: 0)
    assert commands.tracker() == 0
    assert found == ['gait_segmentation.nodes.tracker_node']


def test_commands_run_where_they_are_not_installed() -> None:
    run = [sys.executable, '-m', 'gait_segmentation']
    done = subprocess.run([*run, 'replay', '--help'], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0
    assert done.stdout.startswith('usage: gait_replay ')
    for wrong in ([], ['main'], ['gait_replay']):
        done = subprocess.run([*run, *wrong], cwd=ROOT, capture_output=True, text=True)
        assert done.returncode == 2
        assert 'the commands are detector' in done.stderr


@pytest.mark.parametrize('name', commands.__all__)
def test_ignored_signals_stay_ignored(name: str, monkeypatch) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def main() -> int:
        assert signal.getsignal(signal.SIGINT) == signal.SIG_IGN
        return 0

    modules(monkeypatch, main)
    assert getattr(commands, name)() == 0


@pytest.mark.parametrize('cause', [KeyboardInterrupt, ValueError])
def test_an_interrupt_of_a_call_into_a_kernel_ends_a_command_quietly(
    cause: type[BaseException], monkeypatch, capfd
) -> None:
    def main() -> int:
        raise SystemError('returned a result with an exception set') from cause()

    modules(monkeypatch, main)
    if cause is KeyboardInterrupt:
        assert commands.replay() == 130
        assert capfd.readouterr().err == 'gait_replay: interrupted\n'
    else:
        with pytest.raises(SystemError):
            commands.replay()


def test_all_commands_are_installed() -> None:
    points = re.findall(r"'gait_(\w+) = ([\w.]+):(\w+)'", (ROOT / 'setup.py').read_text())
    assert sorted(points) == [(name, commands.__name__, name) for name in sorted(commands.__all__)]


def test_an_interrupt_that_would_be_lost_comes_a_little_later():
    signal.signal(signal.SIGINT, commands._interrupt)
    reached = []

    def _raw_object_cache_notify():
        signal.raise_signal(signal.SIGINT)
        reached.append(True)

    def work():
        _raw_object_cache_notify()
        time.sleep(10)

    with pytest.raises(KeyboardInterrupt):
        work()
    assert reached
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)

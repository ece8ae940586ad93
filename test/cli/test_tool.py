# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import contextlib
import os
import subprocess
import sys
from pathlib import Path
from unittest.mock import Mock

import pytest

from gait_segmentation import kernels as module
from gait_segmentation.cli import warm_up as command
from gait_segmentation.cli.tool import read_parameter_file, run_tool, scaled_box
from gait_segmentation.errors import ConfigError, SequenceError
from gait_segmentation.geometry import Box
from gait_segmentation.kernels import kernel

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(
    ('error', 'code', 'text'),
    [
        (SequenceError('no such clip'), 2, 'tool: error: no such clip\n'),
        (OSError(30, 'Read-only disk', 'out'), 2, 'tool: error: out: Read-only disk\n'),
        (KeyboardInterrupt(), 130, 'tool: interrupted\n'),
    ],
)
def test_errors_are_one_line(error: BaseException, code: int, text: str, capsys) -> None:
    assert run_tool('tool', lambda: None) == 0
    assert run_tool('tool', lambda: 1) == 1
    assert run_tool('tool', Mock(side_effect=error)) == code
    assert capsys.readouterr().err == text


def test_a_reader_that_leaves_is_no_error() -> None:
    # So little that it is written at the end only.
    script = (
        'import sys; from gait_segmentation.cli.tool import run_tool\n'
        'print("begun", flush=True), sys.stdin.read()\n'
        'sys.exit(run_tool("tool", lambda: print("x")))'
    )
    pipe = subprocess.PIPE
    with subprocess.Popen(
        [sys.executable, '-c', script],
        cwd=ROOT,
        env={**os.environ, 'PYTHONUNBUFFERED': ''},
        stdin=pipe,
        stdout=pipe,
        stderr=pipe,
    ) as process:
        assert process.stdout.readline() == b'begun\n'
        process.stdout.close()
        process.stdin.close()
        assert process.stderr.read() == b''
        assert process.wait(60) == 1


def test_a_console_without_the_letters_of_a_name_is_no_error() -> None:
    script = 'from gait_segmentation.cli.tool import run_tool\nrun_tool("", lambda: print("\xe4"))'
    env = {**os.environ, 'PYTHONIOENCODING': 'ascii'}
    assert subprocess.check_output([sys.executable, '-c', script], cwd=ROOT, env=env) == b'\\xe4\n'


@pytest.mark.parametrize(
    'work', ['print("x")', 'argparse.ArgumentParser().parse_args(["--help"])']
)
def test_a_full_disk_under_the_output_is_said_in_one_line(work: str) -> None:
    script = (
        'import argparse, sys; from gait_segmentation.cli.tool import run_tool\n'
        f'sys.exit(run_tool("tool", lambda: {work}))'
    )
    with open('/dev/full', 'w') as full:
        done = subprocess.run(
            [sys.executable, '-c', script],
            cwd=ROOT,
            # Else argparse hears of it, and says nothing.
            env={**os.environ, 'PYTHONUNBUFFERED': ''},
            stdout=full,
            stderr=subprocess.PIPE,
        )
    assert done.returncode == 2
    assert done.stderr == b'tool: error: No space left on device\n'


def test_when_all_is_compiled_there_is_nothing_to_do(capsys) -> None:
    assert command.main([]) == 0
    capsys.readouterr()
    assert command.main([]) == 0
    assert capsys.readouterr().out == "nothing to do: all kernels are in Numba's cache\n"


def test_the_usage_is_shown_instead_of_compiling(capsys) -> None:
    with contextlib.suppress(SystemExit):
        command.main(['--help'])
    assert 'exit code: 0, also if there is nothing to do' in capsys.readouterr().out


def test_what_is_compiled_is_counted(monkeypatch: pytest.MonkeyPatch, tmp_path, capsys) -> None:
    for name in ('_declared', '_ready'):
        monkeypatch.setattr(module, name, [])
    monkeypatch.setattr(module, '_PACKAGE', 'test')
    monkeypatch.setattr('numba.core.config.CACHE_DIR', str(tmp_path))

    @kernel('i8', 'f8')
    def made_up(number: int) -> int:
        return number + 1

    assert command.main([]) == 0
    assert capsys.readouterr().out == 'kernels compiled, and kept for the next start: 2\n'


@pytest.mark.parametrize(
    'text',
    [
        '',
        'max_people: 2',
        'ros__parameters: {max_people: 2}',
        'gait_traker: {ros__parameters: {max_people: 2}}',
        'gait_tracker: {max_people: 2}',
    ],
)
def test_a_parameter_file_that_sets_nothing_is_refused(text: str, tmp_path: Path) -> None:
    file = tmp_path / 'params.yaml'
    file.write_text(text)
    with pytest.raises(ConfigError, match=r'sets no parameters.*ros__parameters'):
        read_parameter_file(file)
    file.write_text('/robot/gait_tracker: {ros__parameters: {max_people: 2}}')
    assert read_parameter_file(file).config.people.max_people == 2


def test_a_first_box_is_given_in_the_pixels_of_the_input() -> None:
    source = Mock(scale=0.5, size=(320, 240))
    assert scaled_box(Box(400, 80, 60, 200), source) == Box(200, 40, 30, 100)
    with pytest.raises(ConfigError, match='outside of the image'):
        scaled_box(Box(700, 80, 60, 200), source)

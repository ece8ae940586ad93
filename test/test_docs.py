# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the documents point to is there, and what they tell to type is understood."""

from __future__ import annotations

import argparse
import importlib
import re
import runpy
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import cv2
import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import pytest
import yaml

from benchmarks import pipeline
from gait_segmentation.cli import replay
from gait_tools.cli import bank, demo, evaluate, figures
from test.walkers import clip

ROOT = Path(__file__).parents[1]
DOCUMENTS = [
    *(ROOT / name for name in ('README.md', 'CONTRIBUTING.md')),
    *sorted(ROOT.glob('docs/*.md')),
    *sorted(ROOT.glob('examples/*/README.md')),
]
PARSERS = {
    'gait_bank': bank.parser,
    'gait_demo': demo.parser,
    'gait_evaluate': evaluate.parser,
    'gait_figures': figures.parser,
    'gait_replay': replay.parser,
}
FRAMES, FEW = 4, 2


def without_code(text: str) -> str:
    return re.sub(r'(?ms)^```.*?^```', '', text)


def anchors(document: Path) -> set[str]:
    """Return those that GitHub makes of the headings."""
    found = set()
    for heading in re.findall(r'(?m)^#+ (.*)$', without_code(document.read_text())):
        words = re.sub(r'\[([^\]]*)\]\([^)]*\)', r'\1', heading).strip().lower()
        found.add(re.sub(r'[^\w\- ]', '', words).replace(' ', '-'))
    return found


@pytest.mark.parametrize('document', DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_links_lead_somewhere(document: Path) -> None:
    links = re.findall(r'\]\(\s*([^)\s]+)\s*\)', without_code(document.read_text()))
    for link in links:
        if re.match(r'[a-z]+:', link):
            continue
        name, _, anchor = link.partition('#')
        target = (document.parent / name).resolve() if name else document
        assert target.exists(), link
        assert not anchor or anchor in anchors(target), link


def names(document: Path) -> set[str]:
    """Return the Python files, and the files of ``config/``, that a document names."""
    text = re.sub(r'\w+://\S+', '', document.read_text())
    return set(re.findall(r'(?<![\w/.*])((?:\w+/)*[\w.]*\w\.py|config/[\w.]*\w)\b', text))


@pytest.mark.parametrize('document', DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_files_that_are_named_exist(document: Path) -> None:
    folders = ('gait_segmentation', 'benchmarks', 'config', 'examples', 'launch', 'test', 'tools')
    files = [path for name in folders for path in (ROOT / name).rglob('*.*')]
    there = ['/' + str(path.relative_to(ROOT)) for path in (*files, ROOT / 'setup.py')]
    assert [
        name for name in names(document) if not any(path.endswith('/' + name) for path in there)
    ] == []


def options_of(parser: argparse.ArgumentParser) -> set[str]:
    """Return the options of a command and of its subcommands."""
    found: set[str] = set()
    for action in parser._actions:
        found.update(action.option_strings)
        if isinstance(action, argparse._SubParsersAction):
            found.update(*map(options_of, action.choices.values()))
    return found


@pytest.mark.parametrize('document', DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_options_that_are_shown_exist(
    document: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    text = document.read_text().replace('\\\n', ' ')
    for name, shown in re.findall(r'(gait_\w+|benchmarks/\w+\.py)( [^`#\n]*)', text):
        given = set(re.findall(r'(?<=[ \[])--[a-z][\w-]*', shown))
        if name in PARSERS:
            assert given <= options_of(PARSERS[name]()), name
        elif given and name.startswith('benchmarks/'):
            monkeypatch.setattr(sys, 'argv', [name, '--help'])
            with pytest.raises(SystemExit):
                importlib.import_module(name[:-3].replace('/', '.')).main()
            assert given <= set(re.findall(r'--[\w-]+', capsys.readouterr().out)), name


@pytest.mark.parametrize('document', DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_figures_in_tables_have_the_command_that_writes_them(document: Path) -> None:
    for section in re.split(r'(?m)^(?=## )', document.read_text()):
        # What begins with code is defined, not measured.
        if re.search(r'(?m)^\|(?! `).*\| \**\d*\.\d+.*$', section):
            assert re.search(r'gait_evaluate\b|benchmarks/\w+\.py\b', section), section[:80]


def test_what_is_said_of_the_preset_is_the_mean_of_its_clips() -> None:
    text = (ROOT / 'docs/paper.md').read_text()
    found = re.findall(r'(?m)^\| \**([\w-]+)\**((?: \| \**\d+\.\d+ / 0\.\d+\**){3}) \|$', text)
    table = {name: np.array(re.findall(r'[\d.]+', row), float) for name, row in found}
    mean, outdoors, indoors = (table.pop(name) for name in ('mean', 'outdoors', 'indoors'))
    assert len(table) == 12
    # What is averaged has been rounded, and so has the mean.
    rounded = np.tile([0.01, 0.001], 3) + 1e-9
    assert (abs(mean - sum(table.values()) / 12) <= rounded).all()
    assert (abs(mean - (2 * outdoors + 10 * indoors) / 12) <= rounded).all()
    for column in (0, 2, 4):
        assert f'{mean[column]:.2f} %, {mean[column + 1]:.3f}' in text


def commands() -> list[str]:
    text = (ROOT / 'docs/paper.md').read_text()
    lines = re.findall(r'(?m)^    ((?:gait_|python )[^#\n]*)', text)
    # All clips are the example here.
    lines = [re.sub(r'(?<= )data/\*', 'examples/walker', line.strip()) for line in lines]
    return list(dict.fromkeys(lines))


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Have a few frames of the example wherever the documents have clips."""
    whole, short = ROOT / 'examples/walker', tmp_path / 'examples/walker'
    for number in range(FEW):
        for name in (f'frames/{number:04d}.jpg', f'masks/{number:04d}.png'):
            (short / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(whole / name, short / name)
    about = yaml.safe_load((whole / 'sequence.yaml').read_text())
    about['phases'] = about['phases'][:FEW]
    (short / 'sequence.yaml').write_text(yaml.safe_dump(about))
    monkeypatch.chdir(tmp_path)
    return short


@pytest.mark.parametrize('command', commands())
def test_commands_about_the_paper_are_understood(
    command: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = '$' not in command and 'walk.mp4' not in command
    words = shlex.split(re.sub(r'\$\([^)]*\)', str(folder), command))
    program, *given = [str(folder) if word.startswith('data/') else word for word in words]
    threads = cv2.getNumThreads()
    try:
        if whole and program == 'gait_evaluate':
            assert evaluate.main(given) == 0
        elif program in PARSERS:
            PARSERS[program]().parse_args(given)
        elif whole and '--priors' in given:
            monkeypatch.setattr(sys, 'argv', given)
            pipeline.main()
        else:
            assert program == 'python'
            script = [sys.executable, str(ROOT / given[0]), '--help']
            shown = subprocess.run(script, capture_output=True, text=True, check=True).stdout
            assert {word for word in given if word.startswith('--')} <= set(
                re.findall(r'--[\w-]+', shown)
            )
    finally:
        cv2.setNumThreads(threads)


def example(document: str) -> str:
    (code,) = re.findall(r'```python\n(.*?)```', (ROOT / document).read_text(), re.DOTALL)
    return str(code)


def images() -> list[np.ndarray]:
    return [frame.image for frame in clip()[:FRAMES]]


def test_the_example_of_the_readme_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    height, width = images()[0].shape[:2]
    film = cv2.VideoWriter(
        str(tmp_path / 'walk.mp4'), cv2.VideoWriter.fourcc(*'mp4v'), 30, (width, height)
    )
    for image in images():
        film.write(image)
    film.release()
    monkeypatch.chdir(tmp_path)
    found: dict[str, Any] = {}
    exec(example('README.md'), found)
    assert found['frame'].mask.shape == (height, width)
    assert found['frame'].stamp_ns == FRAMES * 10**9 // 30


def test_the_example_of_the_readme_leaves_out_what_cannot_be_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / 'walk.mp4'
    folder.mkdir()
    for index, image in enumerate(images()[:3]):
        cv2.imwrite(str(folder / f'{index}.png'), image)
    (folder / '1.png').write_bytes(b'no picture')
    monkeypatch.chdir(tmp_path)
    found: dict[str, Any] = {}
    exec(example('README.md'), found)
    assert found['frame'].stamp_ns == 3 * 10**9 // 30


def test_the_example_of_the_library_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    class Camera:
        def __init__(self, number: int) -> None:
            self._images = iter(images())

        def read(self) -> tuple[bool, np.ndarray | None]:
            image = next(self._images, None)
            return image is not None, image

    shown: list[np.ndarray] = []
    monkeypatch.setattr(cv2, 'VideoCapture', Camera)
    # Windows would raise: the build of OpenCV that is installed has none.
    monkeypatch.setattr(cv2, 'imwrite', lambda name, image: shown.append(image))
    threads = cv2.getNumThreads()
    try:
        found: dict[str, Any] = {}
        exec(example('docs/library.md'), found)
    finally:
        cv2.setNumThreads(threads)
    assert [each.shape for each in shown] == [image.shape[:2] for image in images()]
    assert len(found['frame'].people) == 2


def test_the_example_that_plots_draws_the_walk(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, 'argv', ['plot_gait.py'])
    matplotlib.use('Agg')
    try:
        found = runpy.run_path(str(ROOT / 'examples/plot_gait.py'))
    finally:
        plt.close('all')
    assert cv2.imread('gait.png').shape == (700, 1000, 3)
    axes = found['axes']
    (phase,), (direction,) = axes['p'].lines, axes['d'].lines
    times = np.asarray(phase.get_xdata())
    truth = yaml.safe_load((ROOT / 'examples/walker/sequence.yaml').read_text())
    # Frame N has the stamp (N + 1) / fps.  Which leg is nearer cannot be seen in a silhouette.
    frames = np.rint(times * truth['fps']).astype(int) - 1
    assert len(frames) > 20
    strides = np.asarray(phase.get_ydata()) - np.asarray(truth['phases'])[frames]
    assert np.abs((strides + 0.25) % 0.5 - 0.25).max() < 0.1
    np.testing.assert_allclose(direction.get_ydata(), 0, atol=20)
    portraits = [axes[place].images[0].get_array() for place in '012345']
    assert min(portrait.std() for portrait in portraits) > 5


@pytest.mark.skipif(shutil.which('make') is None, reason='needs make')
@pytest.mark.parametrize('given', [[], ['FILM=none.mp4']])
def test_an_overlay_without_a_film_says_what_to_type(given: list[str], tmp_path: Path) -> None:
    environment = tmp_path / 'venv'
    command = ['make', '-C', str(ROOT), 'overlay', f'VENV={environment}', *given]
    made = subprocess.run(command, capture_output=True, text=True)
    assert made.returncode == 2
    assert 'make overlay FILM=walk.mp4' in made.stderr
    assert not environment.exists()


@pytest.mark.skipif(shutil.which('make') is None, reason='needs make')
@pytest.mark.parametrize('name', ['my walk (1)', "Tom's walk", 'a$b'])
def test_an_overlay_is_of_the_film_as_typed_and_replaces_nothing(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    said, film = tmp_path / 'venv/bin/gait_replay', tmp_path / f'{name}.mp4'
    said.parent.mkdir(parents=True)
    said.write_text('#!/bin/sh\nprintf "%s\\n" "$@"\n')
    said.chmod(0o755)
    for path in (tmp_path / 'venv/demo', film):
        path.touch()
    monkeypatch.setenv('HOME', str(tmp_path))
    command = ['make', '-sC', str(ROOT), 'overlay', f'VENV={tmp_path}/venv', f'OUT={tmp_path}']
    for given in (film, f'~/{name}.mp4'):
        made = subprocess.run([*command, f'FILM={given}'], capture_output=True, text=True)
        assert made.returncode == 0, made.stderr
        assert {f'{tmp_path}/{name}_overlay.mp4', str(film)} <= set(made.stdout.splitlines())
    # Its own overlay is made again, that of another film of its name is not.
    (tmp_path / f'{name}_overlay.mp4').touch()
    (tmp_path / 'other').mkdir()
    other = film.rename(tmp_path / 'other' / film.name)
    film.touch()
    for each, code in ((film, 0), (other, 2), (film, 0)):
        again = [*command, f'FILM={each}']
        made = subprocess.run(again, capture_output=True, text=True)
        assert (made.returncode, 'is there already' in made.stderr) == (code, code != 0)

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where outputs may be, by gait_replay from end to end."""

from __future__ import annotations

import errno
import re
import shutil
from pathlib import Path
from unittest.mock import Mock

import cv2
import pytest

from gait_segmentation.cli.replay import main
from gait_segmentation.cli.replaying.file_outputs import CsvOutput, MasksOutput
from gait_segmentation.cli.replaying.output import Replayed, remove, work_path
from gait_segmentation.inputs import open_input
from test.files.test_output_files import room_for
from test.inputs.bags import image_fields, stamp, write_bag2
from test.walkers import clip


def copied(path: Path) -> dict[Path, bytes]:
    """Return what is in all files of a folder."""
    return {each: each.read_bytes() for each in sorted(path.rglob('*')) if each.is_file()}


def small_input(kind: str, folder: Path, tmp_path: Path) -> Path:
    """Return a folder of images, a film or a bag, named walk."""
    if kind == 'bag':
        return Path(shutil.copytree(folder / 'walk', tmp_path / 'io/walk'))
    images = [frame.image for frame in clip()[:2]]
    if kind == 'images':
        path = tmp_path / 'io/walk'
        path.mkdir(parents=True)
        for index, image in enumerate(images):
            cv2.imwrite(str(path / f'{index:04d}.png'), image)
        return path
    path = tmp_path / 'io/walk.mp4'
    path.parent.mkdir()
    film = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*'mp4v'), 30, (320, 240))
    for image in images:
        film.write(image)
    film.release()
    return path


@pytest.mark.parametrize('force', [[], ['--force']])
@pytest.mark.parametrize(
    ('kind', 'option', 'place', 'how'),
    [
        ('bag', '--out', 'io', 'is'),
        ('bag', '--masks', 'io/walk/masks', 'lies in'),
        ('bag', '--opengait', 'io', 'is'),
        ('film', '--overlay', 'io/walk.mp4', 'is'),
        ('film', '--overlay', 'hard.mp4', 'is'),
        ('film', '--masks', 'io', 'holds'),
        ('images', '--csv', 'link/walk/0000.png', 'lies in'),
    ],
)
def test_an_input_is_never_an_output(
    folder: Path, tmp_path: Path, force: list[str], capsys, kind: str, option: str, place: str,
    how: str,
) -> None:  # fmt: skip
    source = small_input(kind, folder, tmp_path)
    (tmp_path / 'link').symlink_to('io')
    if kind == 'film':
        (tmp_path / 'hard.mp4').hardlink_to(source)
    before = copied(tmp_path)
    given = [str(source), '--out', str(tmp_path / 'out'), option, str(tmp_path / place), *force]
    assert main(given) == 2
    said = capsys.readouterr().err
    assert said.startswith(f'gait_replay: error: {option} ')
    assert f' {how} the input {source}, which would be changed' in said
    assert copied(tmp_path) == before


@pytest.mark.parametrize(
    'given',
    ['--bank={}', '--params={}', '--heat-map={}', '--set=segmentation.vocabulary={}'],
)
def test_what_else_is_read_is_never_an_output(
    folder: Path, tmp_path: Path, capsys, given: str
) -> None:
    read = tmp_path / 'read'
    read.mkdir()
    if 'params' in given:
        read = read / 'params.yaml'
        read.write_text('{}')
    source = small_input('film', folder, tmp_path)
    before = copied(tmp_path)
    assert main([str(source), '--out', str(read), given.format(read)]) == 2
    assert f'the input {read}, which would be changed' in capsys.readouterr().err
    assert copied(tmp_path) == before


def test_an_interrupted_output_that_is_the_input_now_is_not_removed(
    folder: Path, tmp_path: Path, capsys
) -> None:
    source = small_input('film', folder, tmp_path)
    source = source.rename(source.with_name('walk.partial.mp4'))
    given = [str(source), '--out', str(tmp_path / 'out'), '--overlay']
    assert main([*given, str(source.with_name('walk.mp4'))]) == 2
    assert f'is the input {source}' in capsys.readouterr().err
    assert source.exists()


def foreign(name: str, path: Path) -> None:
    """Make what gait_replay has not made, but might be taken for its output."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if name == 'bag':
        write_bag2(path, {'/mask': [image_fields(clip()[0].image, stamp(0))]})
    elif name == 'masks':
        path.mkdir()
        cv2.imwrite(str(path / '0000.png'), clip()[0].image)
    else:
        path.write_text('frame,grade\n1,A\n')


@pytest.mark.parametrize('force', [[], ['--force']])
@pytest.mark.parametrize(
    ('kind', 'options', 'place'),
    [
        ('bag', [], 'out/walk'),
        ('masks', ['--masks', 'masks'], 'masks'),
        ('table', ['--csv', 'table.csv'], 'table.csv'),
    ],
)
def test_only_an_own_output_counts_as_done_and_is_replaced(
    given: list[str], tmp_path: Path, force: list[str], capsys, monkeypatch, kind: str,
    options: list[str], place: str,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    foreign(kind, tmp_path / place)
    before = copied(tmp_path)
    assert main([*given, *options, *force]) == 2
    said = capsys.readouterr().err
    assert f'{place} was not made by gait_replay, or is not all there, and is not repl' in said
    assert copied(tmp_path) == before


def test_all_own_outputs_are_known_again_and_made_anew_with_force(
    given: list[str], tmp_path: Path, capsys, monkeypatch
) -> None:
    monkeypatch.chdir(tmp_path)
    command = [*given, '--count', '6', '--masks', 'masks', '--csv', 'a.csv', '--opengait', 'gait']
    command += ['--overlay', 'film.avi']
    assert main(command) == 0
    assert main(command) == 0
    assert 'done before' in capsys.readouterr().out
    assert main([*command, '--force']) == 0
    # The one image that cannot be read is in the film, too.
    assert len(list(open_input(tmp_path / 'film.avi').images())) == 6


def test_a_bag_that_is_not_all_there_is_not_done(given: list[str], tmp_path: Path, capsys) -> None:
    assert main(given) == 0
    (tmp_path / 'out/walk/walk.mcap').unlink()
    assert main(given) == 2
    assert 'is not all there' in capsys.readouterr().err


def test_a_link_in_a_circle_is_no_input(tmp_path: Path, capsys) -> None:
    (tmp_path / 'walk.mp4').symlink_to('walk.mp4')
    assert main([str(tmp_path / 'walk.mp4'), '--out', str(tmp_path / 'out')]) == 2
    assert capsys.readouterr().err.count('\n') == 1


@pytest.mark.parametrize(
    ('room', 'options'),
    [
        (1000, []),
        (4_200_000, ['--csv', 'table.csv']),
        (4_200_000, ['--masks', 'masks']),
    ],
    ids=['bag', 'csv', 'masks'],
)
def test_a_full_disk_is_one_line_and_leaves_nothing_hidden(
    given: list[str], tmp_path: Path, monkeypatch, capsys, room: int, options: list[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    place = options[1] if options else 'out'
    if options:
        full = OSError(errno.ENOSPC, 'No space left on device')
        kind = CsvOutput if place == 'table.csv' else MasksOutput
        monkeypatch.setattr(kind, 'add', Mock(side_effect=full))
    with room_for(room):
        assert main([*given, *options, '--count', '3']) == 2
    errors = [line for line in capsys.readouterr().err.splitlines() if 'error' in line]
    assert len(errors) == 1
    reason = 'No space left on device' if options else 'File too large'
    assert re.search(rf'{place}\S*: {reason}$', errors[0])
    assert not list(tmp_path.rglob('.*'))


@pytest.mark.parametrize('gone', ['', 'work'])
@pytest.mark.parametrize(
    'option',
    [('--out', 'out/walk'), ('--masks', 'to/masks'), ('--csv', 'to/a.csv'),
     ('--overlay', 'to/a.mp4'), ('--opengait', 'to')],
    ids=lambda option: option[0],
)  # fmt: skip
def test_an_output_that_is_removed_while_it_is_made_is_one_line(
    given: list[str], tmp_path: Path, monkeypatch, capsys, option: tuple[str, str], gone: str
) -> None:
    monkeypatch.chdir(tmp_path)
    place = Path(option[1])
    output = place / 'walk' if option[0] == '--opengait' else place
    removed = work_path(output) if gone else output.parent
    add = CsvOutput.add

    def remove_then_add(self: CsvOutput, replayed: Replayed) -> None:
        if replayed.frame.number == 2:
            remove(removed)
        add(self, replayed)

    monkeypatch.setattr(CsvOutput, 'add', remove_then_add)
    command = given if option[0] == '--out' else [*given, *option]
    command = ['out' if word == given[-1] else word for word in command]
    # The one that removes must not be removed itself.
    table = [] if option[0] == '--csv' else ['--csv', 'other/table.csv']
    code = main([*command, '--count', '4', *table])
    errors = [line for line in capsys.readouterr().err.splitlines() if 'error' in line]
    assert code == 2
    (error,) = errors
    assert re.search(rf'error: .*{output} cannot be made: \S+, which .* was removed', error)
    assert not list(tmp_path.rglob('.*'))
    monkeypatch.setattr(CsvOutput, 'add', add)
    assert main([*command, '--count', '4', *table]) == 0

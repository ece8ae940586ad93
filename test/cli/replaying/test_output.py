# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from gait_segmentation.cli.replaying.bag_output import BagOutput
from gait_segmentation.cli.replaying.file_outputs import CsvOutput, MasksOutput, OverlayOutput
from gait_segmentation.cli.replaying.output import About
from gait_segmentation.errors import SequenceError


def test_two_cannot_make_the_same_output(tmp_path: Path) -> None:
    first = MasksOutput(tmp_path / 'masks')
    with pytest.raises(SequenceError, match='masks is just being made by another process'):
        MasksOutput(tmp_path / 'masks')
    assert first.work.is_dir()
    MasksOutput(tmp_path / 'others').close(complete=True)
    first.close(complete=True)
    MasksOutput(tmp_path / 'masks').close(complete=True)
    assert sorted(path.name for path in tmp_path.iterdir()) == ['masks', 'others']


@pytest.mark.parametrize('kind', [MasksOutput, CsvOutput, BagOutput])
def test_what_was_killed_is_replaced(kind: Any, tmp_path: Path) -> None:
    killed = kind(tmp_path / 'walk')
    assert killed._held is not None
    os.close(killed._held)
    killed._held = None
    with suppress(OSError, SequenceError):
        killed.finish()
    again = kind(tmp_path / 'walk')
    again.close(complete=True)
    assert [path.name for path in tmp_path.iterdir()] == ['walk']


@pytest.mark.parametrize('kind', [MasksOutput, CsvOutput, BagOutput])
def test_a_folder_of_somebody_else_is_not_removed_whatever_its_name(
    kind: Any, tmp_path: Path
) -> None:
    thesis = tmp_path / '.walk.part/thesis.tex'
    thesis.parent.mkdir()
    thesis.write_text('years of work')
    with pytest.raises(SequenceError, match=r'\.walk\.part .*is not replaced; remove it'):
        kind(tmp_path / 'walk')
    assert [path for path in tmp_path.rglob('*') if path.is_file()] == [thesis]


@pytest.mark.parametrize(
    'name', ['2024-05-01T12:30:05.mp4', 'file:walk.mp4', '100%03d.mp4', '-ä [1].mp4']
)
def test_the_name_of_a_film_is_but_a_name(name: str, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    output = OverlayOutput(Path(name), About((64, 48), 25.0, 1))
    output.close(complete=True)
    assert [path.name for path in tmp_path.iterdir()] == [name]

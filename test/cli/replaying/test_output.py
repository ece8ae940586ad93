# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

from pathlib import Path

import pytest

from gait_segmentation.cli.replaying.file_outputs import MasksOutput
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


def test_an_output_that_was_killed_holds_nobody_up(tmp_path: Path) -> None:
    (tmp_path / '.masks.lock').touch()
    MasksOutput(tmp_path / 'masks').close(complete=True)
    assert [path.name for path in tmp_path.iterdir()] == ['masks']

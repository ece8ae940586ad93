# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Setup.py, as colcon runs it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

SETUP = Path(__file__).parents[1] / 'setup.py'


def test_a_link_to_it_in_another_folder_works(tmp_path: Path) -> None:
    """``colcon build --symlink-install`` makes one in its build folder, and nothing beside it."""
    (tmp_path / 'setup.py').symlink_to(SETUP)
    done = subprocess.run(
        [sys.executable, '-W', 'ignore', 'setup.py', '--name'],
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert done.stdout.strip() == 'gait_segmentation', done.stderr

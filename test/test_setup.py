# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Setup.py, as colcon runs it."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

SETUP = Path(__file__).parents[1] / 'setup.py'
TOOLS = Path(__file__).parents[1] / 'tools/setup.py'
BOUND = re.compile(r"'([\w-]+)>=([\w.]+)'")
OLDEST = Path(__file__).parent / 'oldest.txt'


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


def test_the_lower_bounds_are_the_versions_that_are_tested() -> None:
    texts = [path.read_text(encoding='utf-8') for path in (SETUP, TOOLS)]
    bounds = dict(BOUND.findall(''.join(texts)))
    assert all(bounds[name] == bound for text in texts for name, bound in BOUND.findall(text))
    tested = dict(re.findall(r'^([\w-]+)==([\w.]+)$', OLDEST.read_text(encoding='utf-8'), re.M))
    assert bounds == tested


def test_the_tools_have_the_version_of_the_package() -> None:
    of_package, of_tools = (
        re.findall(r"version='([\d.]+)'", path.read_text(encoding='utf-8'))
        for path in (SETUP, TOOLS)
    )
    assert of_package == of_tools == re.findall(r'gait_segmentation==([\d.]+)', TOOLS.read_text())


def test_everything_that_the_package_needs_has_a_lower_bound() -> None:
    (needed,) = re.findall(r'install_requires=\[(.*?)\]', SETUP.read_text('utf-8'), re.S)
    assert all('>=' in line for line in needed.split())

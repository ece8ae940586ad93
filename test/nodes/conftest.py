# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A private DDS domain for the tests, and what they share."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator
from pathlib import Path

import pytest

# Before rclpy is imported: apart from other ROS systems and from other workers of pytest-xdist,
# and away from the range of gait_demo.
_WORKER = int(os.environ.get('PYTEST_XDIST_WORKER', 'gw0').removeprefix('gw'))
os.environ['ROS_DOMAIN_ID'] = str(1 + (os.getpid() + 7 * _WORKER) % 19)
os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'

rclpy = pytest.importorskip('rclpy', reason='needs ROS 2: rclpy cannot be imported')

with warnings.catch_warnings():
    # rclpy loads it with its first publisher; it uses deprecated modules of Python.
    warnings.simplefilter('ignore', DeprecationWarning)
    pytest.importorskip('rosidl_generator_py')

from test.nodes.bench import Bench  # noqa: E402
from test.walkers import small_bank  # noqa: E402


@pytest.fixture(scope='session')
def bank_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the file of a small bank."""
    path = tmp_path_factory.mktemp('bank') / 'small.npz'
    small_bank().save(path)
    return path


@pytest.fixture
def bench(bank_file: Path) -> Iterator[Bench]:
    """Return a bench of its own rclpy context."""
    made = Bench(bank_file)
    yield made
    made.close()

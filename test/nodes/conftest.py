# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A private DDS domain for the tests, and what they share."""

from __future__ import annotations

import fcntl
import os
import tempfile
import warnings
from collections.abc import Iterator
from pathlib import Path

import pytest

_DOMAINS = range(1, 20)
"""Away from the default, 0, and from the range of gait_demo."""


def _own_domain() -> int:
    """Return a domain that no other test process on this computer uses, held until the end."""
    for domain in _DOMAINS:
        lock = Path(tempfile.gettempdir()) / f'gait_segmentation_test_domain_{domain}.lock'
        try:
            held = os.open(lock, os.O_CREAT | os.O_RDWR, 0o666)
        except OSError:  # Another user's.
            continue
        try:
            fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(held)
            continue
        return domain
    pytest.exit('all DDS domains for tests are in use on this computer', 1)


# Before rclpy is imported: apart from other ROS systems and other workers of pytest-xdist.
os.environ['ROS_DOMAIN_ID'] = str(_own_domain())
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

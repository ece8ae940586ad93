# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Damaged files in the cache of compiled kernels.

Numba keeps what it has compiled in files, and raises whatever unpickling raises where one is cut
off, empty or full of zeros, as a loss of power leaves them.  So the files are looked at before
kernels are called, and the damaged ones are removed: Numba then compiles these kernels anew.
"""

from __future__ import annotations

import io
import logging
import pickletools
import sys
from pathlib import Path
from types import ModuleType

from gait_segmentation.errors import ConfigError

__all__ = ['is_damaged', 'mend_kernel_cache']

_PACKAGE = __name__.partition('.')[0]
_LOGGER = logging.getLogger(_PACKAGE)

_CHECKED: set[Path] = set()
"""Folders that this process has looked at."""


def mend_kernel_cache(package: str = _PACKAGE) -> list[Path]:
    """
    Remove damaged files from the cache of those kernels that are imported by now.

    Every folder is looked at once a process, which takes some ten milliseconds in all, and what
    is removed is logged as a warning.  A file whose bytes were changed, but which is whole, is not
    noticed.

    :param package: whose kernels.
    :returns: the files removed.
    :raises ConfigError: if a damaged file cannot be removed.
    """
    removed = []
    for folder in _folders(package) - _CHECKED:
        _CHECKED.add(folder)
        for path in sorted([*folder.glob('*.nbi'), *folder.glob('*.nbc')]):
            if is_damaged(path):
                _remove(path)
                removed.append(path)
    return removed


def is_damaged(path: Path) -> bool:
    """Return whether a file of the cache is not pickles from beginning to end."""
    try:
        # Not read bit by bit, which would take five times as long.
        data = io.BytesIO(path.read_bytes())
        # An index is two of them: the version and the rest.  They are not loaded: that might need
        # what this version of Numba does not have.
        for _ in range(2 if path.suffix == '.nbi' else 1):
            for _ in pickletools.genops(data):
                pass
    except OSError:
        # Another process has removed it, or nobody may read it, as Numba will say.
        return False
    except Exception:
        # Whatever the damage made of it.
        return True
    return False


def _folders(package: str) -> set[Path]:
    """Return the folders in which Numba keeps the kernels of a package."""
    if 'numba' not in sys.modules:
        return set()
    from numba.core.dispatcher import Dispatcher

    found = set()
    for name, module in list(sys.modules.items()):
        if name.partition('.')[0] == package and isinstance(module, ModuleType):
            for value in vars(module).values():
                if isinstance(value, Dispatcher) and value.stats.cache_path:
                    found.add(Path(value.stats.cache_path))
    return found


def _remove(path: Path) -> None:
    about = f'{path} in the cache of compiled kernels is damaged'
    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        raise ConfigError(
            f'{about} and cannot be removed ({error.strerror}): remove it'
        ) from error
    _LOGGER.warning('%s and was removed: its kernel is compiled anew', about)

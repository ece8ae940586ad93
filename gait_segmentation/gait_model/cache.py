# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The standard bank, drawn once and kept in the user's cache folder."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
from collections.abc import Callable
from dataclasses import asdict
from functools import lru_cache
from pathlib import Path

from gait_segmentation.errors import BankError
from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.gait_model.builder import BankSpec, build_bank, model_digest
from gait_segmentation.gait_model.storage import FORMAT_VERSION

__all__ = ['cache_folder', 'cached_bank', 'default_bank', 'open_bank']

# Plain clothes with even and with uneven arms, something on the back, and cloth over the legs: the
# shapes that differ most.
DEFAULT_SPEC = BankSpec(builds='average,uneven,rucksack,dress')


def cache_folder() -> Path:
    """Return ``$XDG_CACHE_HOME/gait_segmentation``, by default below ``~/.cache``."""
    base = os.environ.get('XDG_CACHE_HOME', '')
    # The XDG specification: a relative path is to be ignored.
    root = Path(base) if os.path.isabs(base) else Path(os.path.expanduser('~/.cache'))
    return root / 'gait_segmentation'


def _key(spec: BankSpec) -> str:
    what = json.dumps([FORMAT_VERSION, model_digest(), asdict(spec)], sort_keys=True)
    return hashlib.sha256(what.encode()).hexdigest()[:20]


def cached_bank(spec: BankSpec, progress: Callable[[], None] | None = None) -> TemplateBank:
    """
    Return the bank of a specification from the cache, drawing it if it is not there.

    A cache that cannot be read or written, or holds a damaged file, only costs the drawing.  The
    last banks read are kept and shared: nobody may write to them.

    :param progress: called after each sequence that is drawn.
    :raises BankError: if a build is unknown.
    """
    path = cache_folder() / f'bank-{_key(spec)}.npz'
    with contextlib.suppress(BankError, OSError):
        found = path.stat()
        return _loaded(path, found.st_mtime_ns, found.st_size)
    bank = build_bank(spec, progress)
    with contextlib.suppress(BankError, OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        bank.save(path)
    return bank


@lru_cache(maxsize=2)
def _loaded(path: Path, changed_ns: int, size: int) -> TemplateBank:
    """Return the bank of a file as it is since a time."""
    return TemplateBank.load(path)


def open_bank(path: str) -> TemplateBank:
    """
    Return the bank of a file, the standard one for an empty path.

    :raises BankError: if it cannot be read.
    """
    return TemplateBank.load(path) if path else default_bank()


def default_bank() -> TemplateBank:
    """
    Return the standard bank.

    :returns: the bank of :data:`DEFAULT_SPEC`.
    """
    return cached_bank(DEFAULT_SPEC)

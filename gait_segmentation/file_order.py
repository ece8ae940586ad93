# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The order of files that are the frames of something."""

from __future__ import annotations

import re
from pathlib import Path

__all__ = ['by_number']

_NUMBER = re.compile(r'(\d+)')


def by_number(path: Path) -> tuple[list[str | int], str]:
    """Return a key that sorts names with numbers by these: frame2 before frame10."""
    parts: list[str | int] = list(_NUMBER.split(path.name))
    # Every second part is a number.
    parts[1::2] = [int(part) for part in parts[1::2]]
    return parts, path.name

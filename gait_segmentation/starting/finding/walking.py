# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The log-odds that something that moves is somebody who walks, by a logistic regression.

``walking.json`` holds rows of a measure, its weight and the range it is cut to; two rows of the
same measure bend the line at the median of people.  ``benchmarks/walking.py`` learns it.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

MODEL_FILE = Path(__file__).with_name('walking.json')
_MODEL = json.loads(MODEL_FILE.read_text(encoding='utf-8'))
_MOST = 4.0
"""Most that one frame may say for or against: one in fifty."""


def log_odds(measures: Mapping[str, float]) -> float:
    """Return the log-odds that something with such measures walks, within +-4."""
    total = float(_MODEL['intercept'])
    for name, weight, low, high in _MODEL['rows']:
        total += weight * min(max(measures[name], low), high)
    return min(max(total, -_MOST), _MOST)

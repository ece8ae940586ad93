# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The log-odds that something watched is a walker, by a logistic regression of a few measures.

``walking.json`` holds, for each measure, its weight and the range it is cut to.  It was learnt
from synthetic walkers and synthetic things that move; ``benchmarks/walking.py`` learns it anew.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

__all__ = ['LEAST_SHAPES', 'MODEL_FILE', 'log_odds']

LEAST_SHAPES = 3
"""Shapes from which on a gait can be measured."""

MODEL_FILE = Path(__file__).with_name('walking.json')
_MODEL = json.loads(MODEL_FILE.read_text(encoding='utf-8'))
_MOST = 4.0
"""Most that one match may say for or against: one in fifty."""


def log_odds(measures: Mapping[str, float]) -> float:
    """
    Return the log-odds that something with such measures walks, within +-4.

    :param measures: by name; those without a weight do not count.
    """
    total = float(_MODEL['intercept'])
    for name, (weight, low, high) in _MODEL['measures'].items():
        total += weight * min(max(measures[name], low), high)
    return min(max(total, -_MOST), _MOST)

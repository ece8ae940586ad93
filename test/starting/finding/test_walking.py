# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import json

from gait_segmentation.starting.finding.walking import MODEL_FILE, log_odds

MODEL = json.loads(MODEL_FILE.read_text(encoding='utf-8'))


def extreme(side: int) -> dict[str, float]:
    """Return the measures that speak most for (1) or against (-1) a walker."""
    values: dict[str, list[float]] = {}
    for name, _, low, high in MODEL['rows']:
        values.setdefault(name, []).extend((low, high))
    best = {}
    for name, bends in values.items():
        rows = [row[1:] for row in MODEL['rows'] if row[0] == name]
        told = {
            value: side * sum(weight * min(max(value, low), high) for weight, low, high in rows)
            for value in bends
        }
        best[name] = max(told, key=lambda value: told[value])
    return best


def test_one_frame_says_little_either_way() -> None:
    assert 2 < log_odds(extreme(1)) <= 4
    assert log_odds(extreme(-1)) == -4


def test_what_is_more_than_usual_counts_as_usual() -> None:
    usual = extreme(1)
    most = max(high for name, _, _, high in MODEL['rows'] if name == 'similarity')
    assert log_odds(usual | {'similarity': most}) == log_odds(usual | {'similarity': most + 1})


def test_who_resembles_a_template_walks() -> None:
    assert all(weight > 0 for name, weight, _, _ in MODEL['rows'] if name == 'similarity')

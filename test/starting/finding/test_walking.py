# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import json

import pytest

from gait_segmentation.starting.finding.walking import MODEL_FILE, log_odds

MODEL = json.loads(MODEL_FILE.read_text(encoding='utf-8'))


def typical(side: int) -> dict[str, float]:
    """Return the measures that speak most for (1) or against (-1) a walker."""
    return {
        name: high if side * weight > 0 else low
        for name, (weight, low, high) in MODEL['measures'].items()
    }


def test_one_match_says_little_either_way() -> None:
    assert 2 < log_odds(typical(1)) <= 4
    assert log_odds(typical(-1)) == -4


def test_what_is_more_than_usual_counts_as_usual() -> None:
    best = typical(1)
    beyond = {
        name: value + (10 if MODEL['measures'][name][0] > 0 else -10)
        for name, value in best.items()
    }
    assert log_odds(beyond) == log_odds(best)


@pytest.mark.parametrize('name', ['similarity', 'swing', 'cover'])
def test_who_resembles_a_template_swings_and_is_covered_walks(name: str) -> None:
    assert MODEL['measures'][name][0] > 0

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

from collections.abc import Iterable

import pytest

from gait_segmentation.streams.join import ExactJoin
from gait_segmentation.streams.warnings import Warnings


class Log:
    """Warnings at given times, and what was logged."""

    def __init__(self, times: Iterable[float]) -> None:
        self.said: list[str] = []
        clock = iter(times)
        self.warnings = Warnings(self.said.append, lambda: next(clock))


def test_warnings_of_one_key_are_at_least_5_seconds_apart() -> None:
    log = Log((0.1, 1.0, 2.0, 5.0, 5.2, 10.1, 10.3))
    texts = [('a', 'first'), ('b', 'other'), *(('a', text) for text in ('2', '3', '4', '5', '6'))]
    assert [log.warnings.warn(*each) for each in texts] == [True, True, *[False] * 2, True, False,
                                                            True]  # fmt: skip
    assert log.said == ['first', 'other', '4', '6']
    assert log.warnings.keys == {'a', 'b'}


def test_frames_that_were_not_told_of_are_told_of_with_the_next() -> None:
    log = Log((0.0, 1.0, 2.0, 6.0, 12.0))
    for text in ('a {}', 'a {}', 'b {}', 'a {}', 'a {}'):
        log.warnings.warn_of({'a {}': 3, 'b {}': 1}[text], text)
    assert log.said == ['a 3 frames', 'b 1 frame', 'a 6 frames', 'a 3 frames']


@pytest.mark.parametrize(
    ('remedy', 'end'),
    [
        ('', 'when there was no room for more than 7 that wait'),
        ('buy more', 'when there was no room for more than 7 that wait: buy more'),
    ],
)
def test_it_is_told_who_is_to_blame_for_frames_that_are_not_complete(
    remedy: str, end: str
) -> None:
    join = ExactJoin({'camera': ['image'], 'tracker': ['box']}, 7)
    join.skipped['tracker'] += 1
    join.missed['box'] += 2
    join.late['box'] += 3
    log = Log(range(3))
    log.warnings.warn_of_missed(join, remedy)
    skipped, missed, late = log.said
    assert skipped.startswith('tracker said nothing of 1 frame, ')
    assert missed.startswith('box did not come for 2 frames: ')
    assert late == f'box had not come for 3 frames {end}'


def test_a_line_of_the_log_is_short_whatever_names_are_in_it() -> None:
    log = Log((0.0,))
    log.warnings.warn('names', f'got {["x" * 50_000]}')
    (said,) = log.said
    assert len(said) < 500
    assert said.startswith('got [')
    assert said.endswith('(50008 characters)')

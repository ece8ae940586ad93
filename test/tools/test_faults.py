# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The planted faults: the list fits the code, and what is drawn changes a result."""

from __future__ import annotations

from pathlib import Path

from faults import PACKAGE, listed, statement
from mutants import draw, edits


def test_every_entry_of_the_list_stands_once_in_its_file() -> None:
    assert len(listed()) > 250  # It raises what does not fit.


def test_each_seed_draws_others_and_always_the_same(tmp_path: Path) -> None:
    for name in 'ab':
        (tmp_path / PACKAGE).mkdir(exist_ok=True)
        (tmp_path / PACKAGE / f'{name}.py').write_text('x = 1\ny = x < 2 and not x\nf(x, y)\n')
    first, again, other = (list(draw(tmp_path, PACKAGE, 4, seed)) for seed in (1, 1, 3))
    assert first == again != other
    assert {file for file, *_ in first} == {f'{PACKAGE}/a.py', f'{PACKAGE}/b.py'}


def test_texts_types_and_what_is_raised_or_logged_are_left_alone() -> None:
    plain = '"""One."""\ndef f(x: int = N) -> tuple[1]:\n    log(1)\n    raise E(f"{x + 1}", 2)\n'
    assert not list(edits(plain))
    changed = {(old, new) for _, old, new in edits('if a <= -1:\n    self.b = min(c, d)\n')}
    assert {('a <= -1', '(a < -1)'), ('min', 'max'), ('self.b = min(c, d)', 'pass')} <= changed
    assert ('a <= -1', '(not a <= -1)') in changed


def test_the_lines_of_a_fault_are_those_of_its_statement_alone() -> None:
    text = 'if a(\n    b\n):\n    c = (\n        d\n    )\n'
    assert [list(statement(text, line, line)) for line in (2, 5)] == [[1, 2, 3], [4, 5, 6]]

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Draw mechanical faults for ``faults.py``: one operator on one line of a module, all at random.

A comparison, an operator of arithmetic or logic, a number, a condition, two arguments, a call for
its effect, an attribute that is set: what is left is Python of the same kind.  Left alone is what
is no part of a result: types, texts, decorators, what is raised, logged or asserted.
"""

from __future__ import annotations

import ast
import copy
import random
from collections.abc import Iterator
from pathlib import Path

Edit = tuple[int, str, str]
"""Place in a text, what stands there, and what takes its place."""

_SWAPS: dict[type, tuple[type, ...]] = {
    ast.Lt: (ast.LtE, ast.Gt),
    ast.LtE: (ast.Lt, ast.GtE),
    ast.Gt: (ast.GtE, ast.Lt),
    ast.GtE: (ast.Gt, ast.LtE),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
    ast.Add: (ast.Sub,),
    ast.Sub: (ast.Add,),
    ast.Mult: (ast.Div,),
    ast.Div: (ast.Mult,),
    ast.FloorDiv: (ast.Mult,),
    ast.Mod: (ast.FloorDiv,),
    ast.Pow: (ast.Mult,),
    ast.LShift: (ast.RShift,),
    ast.RShift: (ast.LShift,),
    ast.BitAnd: (ast.BitOr,),
    ast.BitOr: (ast.BitAnd,),
    ast.And: (ast.Or,),
    ast.Or: (ast.And,),
}
_NAMES = {'min': 'max', 'minimum': 'maximum', 'floor': 'ceil', 'sin': 'cos', 'any': 'all'}
_NAMES |= {new: old for old, new in _NAMES.items()}
_SAYS = {'debug', 'info', 'warning', 'warn', 'error', 'exception', 'print', 'say', 'log'}


def draw(root: Path, package: str, count: int, seed: int) -> Iterator[tuple[str, int, str, str]]:
    """Yield file, place in its text, what stands there and what takes its place, all different."""
    chance = random.Random(seed)
    texts = {path: path.read_text(encoding='utf-8') for path in (root / package).rglob('*.py')}
    left: dict[Path, dict[int, list[Edit]]] = {}
    for path in sorted(texts):
        by_line = left[path] = {}
        for edit in edits(texts[path]):
            by_line.setdefault(texts[path].count('\n', 0, edit[0]), []).append(edit)
    while count and (some := [path for path, lines in left.items() if lines]):
        # Each module once, then each again.
        for path in chance.sample(some, min(count, len(some))):
            line = chance.choice(sorted(left[path]))
            start, old, new = chance.choice(left[path].pop(line))
            if differs(texts[path], start, old, new):
                yield path.relative_to(root).as_posix(), start, old, new
                count -= 1


def edits(text: str) -> Iterator[Edit]:
    """Yield all edits of a module."""
    lines = text.encode().splitlines(keepends=True)
    begins = [0]
    for line in lines:
        begins.append(begins[-1] + len(line.decode()))

    def place(line: int, column: int) -> int:
        return begins[line - 1] + len(lines[line - 1][:column].decode())

    for node in parts(ast.parse(text)):
        for what, other in changed(node):
            start = place(what.lineno, what.col_offset)
            old = text[start : place(what.end_lineno or 0, what.end_col_offset or 0)]
            new = ast.unparse(other)
            plain = isinstance(other, ast.stmt | ast.Constant | ast.Name | ast.Attribute)
            yield start, old, new if plain else f'({new})'


def differs(text: str, start: int, old: str, new: str) -> bool:
    """Return whether an edit gives another program."""
    try:
        made = ast.parse(text[:start] + new + text[start + len(old) :])
    except SyntaxError:
        return False
    return ast.dump(made) != ast.dump(ast.parse(text))


def parts(node: ast.AST) -> Iterator[ast.expr | ast.stmt]:
    """Yield the nodes of a tree that are part of what it does."""
    if isinstance(node, ast.Raise | ast.Assert | ast.JoinedStr | ast.Import | ast.ImportFrom):
        return
    if isinstance(node, ast.Call) and _called(node) in _SAYS:
        return
    if isinstance(node, ast.expr | ast.stmt):
        yield node
    for name, value in ast.iter_fields(node):
        if name in ('annotation', 'returns', 'decorator_list', 'type_params'):
            continue
        for each in value if isinstance(value, list) else [value]:
            if isinstance(each, ast.AST) and getattr(each, 'arg', '') != 'strict':
                yield from parts(each)


def _called(node: ast.Call) -> str:
    return getattr(node.func, 'id', getattr(node.func, 'attr', ''))


def changed(node: ast.expr | ast.stmt) -> Iterator[tuple[ast.expr | ast.stmt, ast.AST]]:
    """Yield what one operator makes of a node, or of its condition."""
    if isinstance(node, ast.Compare) and len(node.ops) == 1:
        for swap in _SWAPS[type(node.ops[0])]:
            yield node, ast.Compare(node.left, [swap()], node.comparators)
    elif isinstance(node, ast.BinOp | ast.BoolOp | ast.AugAssign) and type(node.op) in _SWAPS:
        yield node, _with(node, 'op', _SWAPS[type(node.op)][0]())
    elif isinstance(node, ast.UnaryOp):
        yield node, node.operand
    elif isinstance(node, ast.Constant) and isinstance(node.value, bool):
        yield node, ast.Constant(not node.value)
    elif isinstance(node, ast.Constant) and isinstance(node.value, int):
        yield from ((node, ast.Constant(node.value + by)) for by in (1, -1))
    elif isinstance(node, ast.Constant) and isinstance(node.value, float):
        yield from ((node, ast.Constant(value)) for value in (2 * node.value + 1, node.value / 2))
    elif isinstance(node, ast.If | ast.IfExp):
        yield node.test, ast.UnaryOp(ast.Not(), node.test)
    elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
        if _called(node.value) not in _SAYS | {'super', '__init__'}:
            yield node, ast.Pass()
    elif isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Attribute):
        yield node, ast.Pass()
    elif isinstance(node, ast.Return) and isinstance(node.value, ast.BinOp):
        yield node.value, ast.UnaryOp(ast.USub(), node.value)
    elif isinstance(node, ast.Call) and len(node.args) > 1:
        first, second, *rest = node.args
        if type(first) is type(second) and _called(node) not in _NAMES:
            yield node, ast.Call(node.func, [second, first, *rest], node.keywords)
    elif isinstance(node, ast.Name | ast.Attribute):
        name = 'id' if isinstance(node, ast.Name) else 'attr'
        if getattr(node, name) in _NAMES:
            yield node, _with(node, name, _NAMES[getattr(node, name)])


def _with(node: ast.AST, name: str, value: object) -> ast.AST:
    made = copy.copy(node)
    setattr(made, name, value)
    return made

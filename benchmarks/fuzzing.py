# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the fuzzers share: examples of hypothesis for some minutes, and bytes that are spoilt."""

from __future__ import annotations

import argparse
import faulthandler
import math
import multiprocessing
import secrets
import signal
import struct
import time
import traceback
import zlib
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from random import Random

from hypothesis import HealthCheck, given, seed, settings, strategies as st
from hypothesis.errors import FlakyStrategyDefinition

_LONGEST_S = 900
"""Time after which an example counts as one that never ends; the first may compile kernels."""


class _TimeUp(BaseException):
    """No failure: hypothesis lets it through."""


def _run(play: Callable[[st.DataObject], None], number: int, most: int, until: float) -> int:
    """Play examples from a seed; return how many, or raise what is wrong with the simplest."""
    played = 0

    @seed(number)
    @settings(max_examples=most, deadline=None, database=None,
              suppress_health_check=list(HealthCheck))  # fmt: skip
    @given(st.data())
    def examples(data: st.DataObject) -> None:
        nonlocal played
        if time.time() > until:
            raise _TimeUp
        # Ends the process if the example never ends.
        faulthandler.dump_traceback_later(_LONGEST_S, exit=True)
        play(data)
        faulthandler.cancel_dump_traceback_later()
        played += 1

    try:
        examples()
    except (_TimeUp, FlakyStrategyDefinition):
        # To stop without drawing is inconsistent, to hypothesis.
        if time.time() < until:
            raise
    return played


def fuzz_parser(about: str, minutes: float = math.inf) -> argparse.ArgumentParser:
    """Return a parser of what all fuzzers take: a seed, and how long they go on."""
    parser = argparse.ArgumentParser(
        description=about, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add = parser.add_argument
    add('--minutes', type=float, default=minutes, metavar='M', help='at most (%(default)s)')
    add('--seed', type=int, default=secrets.randbelow(10**9), metavar='S', help='(random)')
    return parser


def fuzz(play: Callable[[st.DataObject], None], prepare: Callable[[], object], about: str) -> int:
    """
    Read the command line, play examples, say what came of them and return the exit code.

    :param play: draws an example and plays it, in another process; raises what is wrong.
    :param prepare: called in each of these processes before.
    """
    parser = fuzz_parser(about)
    add = parser.add_argument
    add('--cases', type=int, default=2000, metavar='N', help='(%(default)s)')
    add('--processes', type=int, default=2, metavar='N', help='each has the next seed (2)')
    options = parser.parse_args()
    # As Ctrl-C does, it ends the other processes, too.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    print(f'seed {options.seed}', flush=True)
    until, share = time.time() + 60 * options.minutes, -(-options.cases // options.processes)
    played, fine = 0, True
    context = multiprocessing.get_context('spawn')
    with ProcessPoolExecutor(options.processes, context, prepare) as pool:
        seeds = range(options.seed, options.seed + options.processes)
        runs = {number: pool.submit(_run, play, number, share, until) for number in seeds}
        for number, run in runs.items():
            try:
                played += run.result()
            except Exception:
                fine = False
                print(f'--seed {number} --processes 1 fails:\n{traceback.format_exc()}')
    print(f'{played} cases played{"" if fine else " by those without a failure"}')
    return 0 if fine else 1


_HUGE = (0, 1, 0x7F, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF)
_WORDS = ('1e400', '-1', '.nan', '.inf', '9' * 30, '9' * 5000, "'x'", '[]', '{}', '~', 'true',
          '2001-99-99', '\\x00', '*a', '&a [*a]', '[' * 3000, '{a: ' * 3000, '1e-320')  # fmt: skip


def _place(rng: Random, data: bytes) -> int:
    """Return a place, in the first bytes as often as anywhere."""
    return rng.randrange(max(min(len(data), rng.choice([64, len(data)])), 1))


def _flip(rng: Random, data: bytes) -> bytes:
    made = bytearray(data)
    for _ in range(rng.choice([1, 3, 30]) if data else 0):
        made[_place(rng, data)] ^= 1 << rng.randrange(8)
    return bytes(made)


def _replace(rng: Random, data: bytes) -> bytes:
    """Put something else in the place of a piece: nothing, zeros, garbage, another piece."""
    at, other = _place(rng, data), _place(rng, data)
    old = data[at : at + rng.choice([9, 400, 4096, len(data)])]
    garbage = rng.randbytes(rng.choice([1, 16, 1000]))
    new = rng.choice([b'', bytes(len(old)), garbage, data[other:], old[:9999] * 50])
    return data[:at] + new + data[at + len(old) :]


def _number(rng: Random, data: bytes) -> bytes:
    at, form = _place(rng, data), rng.choice('<>') + rng.choice('HIQ')
    value = rng.choice(_HUGE) & (2 ** (8 * struct.calcsize(form)) - 1)
    return data[:at] + struct.pack(form, value) + data[at + struct.calcsize(form) :]


def _size(rng: Random, data: bytes) -> bytes:
    """Let an image claim another size, in a PNG with the right sum."""
    width, height = (rng.choice([0, 1, 3, 70_000, 2**31 - 1]) for _ in range(2))
    if data[:4] == b'\x89PNG':
        header = data[12:16] + struct.pack('>II', width, height) + data[24:29]
        return data[:12] + header + struct.pack('>I', zlib.crc32(header)) + data[33:]
    at = data.find(b'\xff\xc0')
    if at > 0:
        return data[: at + 5] + struct.pack('>HH', height & 65535, width & 65535) + data[at + 9 :]
    return _number(rng, data)


def _text(rng: Random, data: bytes) -> bytes:
    """Change a value of a text."""
    word = rng.choice(_WORDS).encode()
    at = [index for index, byte in enumerate(data[:20_000]) if byte in b':,[']
    place = rng.choice(at) + 1 if at else 0
    end = min((e for e in (data.find(b, place) for b in b',]}\n') if e >= 0), default=len(data))
    return data[:place] + b' ' + word + data[end:]


CHANGES: dict[str, Callable[[Random, bytes], bytes]] = {
    'flip': _flip,
    'replace': _replace,
    'truncate': lambda rng, data: data[: rng.randrange(len(data) + 1)],
    'number': _number,
    'size': _size,
    'text': _text,
    'empty': lambda rng, data: b'',
}
"""How bytes may be changed, by the name of the change."""

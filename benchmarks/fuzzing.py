# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Examples of hypothesis without an end, on several processors, for some minutes."""

from __future__ import annotations

import argparse
import faulthandler
import math
import multiprocessing
import secrets
import signal
import time
import traceback
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor

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


def fuzz(play: Callable[[st.DataObject], None], prepare: Callable[[], object], about: str) -> int:
    """
    Read the command line, play examples, say what came of them and return the exit code.

    :param play: draws an example and plays it, in another process; raises what is wrong.
    :param prepare: called in each of these processes before.
    """
    parser = argparse.ArgumentParser(
        description=about, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add = parser.add_argument
    add('--cases', type=int, default=2000, metavar='N', help='(%(default)s)')
    add('--minutes', type=float, default=math.inf, metavar='M', help='begin none after that')
    add('--seed', type=int, default=secrets.randbelow(10**9), metavar='S', help='(random)')
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

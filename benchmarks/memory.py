#!/usr/bin/env python3
# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Memory of the standard bank and of a matcher that runs for long.

Prints the size of the standard bank with its events, of the whole matcher with the arrays it
searches in, and how the process' resident memory changes over many updates, from the time when
all buffers are full.  The updates use a small bank, so that 100 000 of them take a few minutes;
what could grow (window, history, results) does not depend on the bank's size.
"""

from __future__ import annotations

import argparse
import math
import sys
import tracemalloc
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))


from gait_segmentation.cli.tool import run_tool
from gait_segmentation.gait_model import BankSpec, build_bank, default_bank
from gait_segmentation.gait_model.render import render_silhouette
from gait_segmentation.geometry import Box
from gait_segmentation.matching import MatchingConfig, SequenceMatcher
from gait_segmentation.matching.placements import PlacementGrid
from gait_segmentation.matching.similarities import coded_bank

MIB = 2**20
STEP_NS = 33_333_333


def resident() -> float:
    """Return the resident memory of this process in MiB (Linux)."""
    pages = int(Path('/proc/self/statm').read_text().split()[1])
    return pages * 4096 / MIB


def sizes() -> dict[str, float]:
    """Return the sizes of the standard bank, its events, and a matcher, in MiB."""
    bank = default_bank()
    config = MatchingConfig()
    windows = PlacementGrid(bank.grid, bank.fill, config).windows
    coded_bank(bank, 2, windows)  # compile
    tracemalloc.start()
    coded = coded_bank(bank, config.levels, windows)
    events, peak = (value / MIB for value in tracemalloc.get_traced_memory())
    del coded
    coded_bank.cache_clear()
    tracemalloc.reset_peak()
    before = tracemalloc.get_traced_memory()[0]
    matcher = SequenceMatcher(bank, config)
    whole = (tracemalloc.get_traced_memory()[0] - before) / MIB
    tracemalloc.stop()
    del matcher
    return {
        'templates': bank.templates.nbytes / MIB,
        'events': events,
        'events while coding': peak,
        'matcher': whole,
    }


def grow(updates: int) -> list[tuple[int, float]]:
    """Run a matcher and return the resident memory at ten times."""
    bank = build_bank(BankSpec(height=48, width=32, azimuths=4, phases=16))
    matcher = SequenceMatcher(bank, MatchingConfig(shifts_x=1, shifts_y=1, scales=0, lag=2))
    pictures = [render_silhouette(k / 30, math.pi / 4, 40.0) for k in range(30)]
    height, width = pictures[0].shape
    found = []
    for number in range(1, updates + 1):
        picture = pictures[number % len(pictures)]
        box = Box.around(picture > 127)
        matcher.update(
            picture,
            box,
            number * STEP_NS,
            track_id=1 + number // 5000,
            source_size=(width, height),
        )
        if number % (updates // 10) == 0:
            found.append((number, resident()))
    return found


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0].strip())
    parser.add_argument('--updates', type=int, default=100_000)
    options = parser.parse_args()
    for name, size in sizes().items():
        print(f'{name:22} {size:6.1f} MiB')
    rows = grow(max(options.updates, 10))
    for number, size in rows:
        print(f'{number:8} updates {size:8.2f} MiB resident')
    print(f'growth after the first tenth: {rows[-1][1] - rows[0][1]:+.2f} MiB')
    return 0


if __name__ == '__main__':
    sys.exit(run_tool('memory.py', main))

#!/usr/bin/env python3
# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Time of the matching kernels against the number of templates.

Every kernel gets the same input, one padded likelihood image for each of 5 body heights, and
has to produce the common area of K templates of 96 x 64 pixels with all 605 windows, preparation
included.  The templates are one walk in profile sampled at K phases, binary (``events``,
``gemm``) or with 8 grey levels (``events_soft``, ``direct_access_table``, ``reference``), or one
that walks obliquely, with 8 grey levels as by default (``events_oblique``).  In profile the halves
of a stride are alike: how many different templates there are is printed, and ``gemm``, one
float32 matrix product on one thread, the honest rival for binary templates, is given only these.
``events_views`` is 16 views of K / 16 phases with 8 grey levels.  ``table_no_black`` is the direct
access table of templates that are black nowhere, so that none can be passed over, and ``naive``
what the paper started from: every window resampled by itself, and the sums of both the minimum
and the maximum.  ``update_ms`` is a whole update of the matcher, resampling, kernel, path and
result, with all placements (``all``) and those searched by default (``usual``), by kernel and
number of templates: one view of the standard bank, and all of it.

Times are medians of repeats, the sizes of a kind in turn, of the processor time of the one thread
that works, so that other programs on the machine disturb them little.
A call that is not timed goes before each that is, so that all find their own caches warm.
Prints the table, writes it with ``--json`` and draws docs/images/matching_scaling.png with
``--plots``.
"""

# ruff: noqa: E402 (threads are limited before NumPy is loaded)

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

for _name in ('OPENBLAS_NUM_THREADS', 'MKL_NUM_THREADS', 'OMP_NUM_THREADS'):
    os.environ[_name] = '1'  # before NumPy is loaded

import cv2
import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks import holds
from gait_segmentation.cli.tool import run_tool
from gait_segmentation.gait_model import TemplateBank, default_bank
from gait_segmentation.gait_model.bank import quantize
from gait_segmentation.geometry import Box
from gait_segmentation.matching import MatchingConfig, SequenceMatcher
from gait_segmentation.matching.common_areas import CommonAreas, DirectAccessTableKernel
from gait_segmentation.matching.events import EventKernel
from gait_segmentation.matching.matcher import KERNELS
from gait_segmentation.matching.placements import SearchRange, WindowGrid
from gait_segmentation.results import TrackResult
from gait_tools.gait_model.render import render_cycle, render_silhouette

ROOT = Path(__file__).resolve().parents[1]
COUNTS = (30, 60, 120, 240, 480, 960)
GRID = WindowGrid(96, 64, 11, 11, 2)
SCALES = 5
OBLIQUE = np.pi / 4
KINDS = {'binary': 'events', 'soft': 'events_soft', 'oblique': 'events_oblique',
         'views': 'events_views'}  # fmt: skip
SLOW = 2_000_000  # templates x windows above which the slow kernels see only a part
Images = NDArray[np.uint8]


def windows_of(images: Images, grid: WindowGrid) -> Images:
    """Return all windows of (S, *grid.image_shape) images, (S, rows, columns, height, width)."""
    view = np.lib.stride_tricks.sliding_window_view(images, (grid.height, grid.width), (1, 2))
    return view[:, :: grid.step, :: grid.step]


class Ready:
    """A kernel of the package with the memory it works in; all its windows are compared."""

    def __init__(self, kind: type[CommonAreas], templates: Images, grid: WindowGrid) -> None:
        self.kernel = kind(templates, grid)
        self.grid = grid
        self.matrix = self.kernel.new_matrix()
        self.out = self.kernel.new_rows(0)

    def rows(self, images: Images) -> NDArray[np.int32]:
        """Compute C as the matcher does, without putting the rows in the order of templates."""
        searched = SearchRange((0, 0, 0), (len(images), self.grid.rows, self.grid.columns))
        if self.out.shape[1] != searched.pitch:
            self.out = self.kernel.new_rows(searched.pitch)
        return self.kernel.common_rows(images, searched, self.matrix, self.out)

    def additions(self, images: Images) -> float:
        """Return how many templates one lookup of the direct access table changes, on average."""
        table = self.kernel
        assert isinstance(table, DirectAccessTableKernel)
        values = windows_of(images, self.grid)[..., table.pixels[:, 0], table.pixels[:, 1]]
        return float(table.changed[np.arange(len(table.pixels)), values].mean())

    def common_area(self, images: Images) -> NDArray[np.int32]:
        """Return C of all templates, (K, S, rows, columns)."""
        windows = len(images), self.grid.rows, self.grid.columns
        rows = self.rows(images)[self.kernel.row]
        return rows[:, : int(np.prod(windows))].reshape(-1, *windows)


class Reference:
    """Common areas by the definition, in NumPy."""

    def __init__(self, templates: Images, grid: WindowGrid) -> None:
        # The kernels make equal templates once, too.
        self._templates, self._row = np.unique(templates, axis=0, return_inverse=True)
        self._grid = grid

    def common_area(self, images: Images) -> NDArray[np.int32]:
        """Take the smaller of template and window, window by window."""
        windows = windows_of(images, self._grid)
        result = np.zeros((len(self._templates), *windows.shape[:3]), np.int32)
        for image, row, column in np.ndindex(result.shape[1:]):
            common = np.minimum(self._templates, windows[image, row, column])
            result[:, image, row, column] = common.sum(axis=(1, 2), dtype=np.int32)
        return result[self._row.reshape(-1)]


class MatrixProduct:
    """Common areas of binary templates as one float32 matrix product; exact below 2**24."""

    def __init__(self, templates: Images, grid: WindowGrid) -> None:
        self._templates = (templates.reshape(len(templates), -1) > 0).astype(np.float32)
        self._grid = grid

    def common_area(self, images: Images) -> NDArray[np.int32]:
        """Gather all windows and multiply."""
        windows = windows_of(images, self._grid)
        pixels = windows.reshape(-1, self._templates.shape[1]).astype(np.float32)
        common = self._templates @ pixels.T
        return common.astype(np.int32).reshape(len(common), *windows.shape[:3])


class Naive:
    """Both sums of equation 1, each window resampled by itself."""

    def __init__(self, templates: Images, grid: WindowGrid) -> None:
        self._templates = templates
        self._grid = grid

    def common_area(self, images: Images) -> NDArray[np.int64]:
        """Return the sums of the minimum; those of the maximum are made for their time."""
        grid, (count, height, width) = self._grid, self._templates.shape
        result = np.zeros((count, len(images), grid.rows, grid.columns), np.int64)
        for image, row, column in np.ndindex(result.shape[1:]):
            move = np.array([[1, 0, -grid.step * column], [0, 1, -grid.step * row]], float)
            window = cv2.warpAffine(images[image], move, (width, height))
            result[:, image, row, column] = np.minimum(self._templates, window).sum(axis=(1, 2))
            np.maximum(self._templates, window).sum(axis=(1, 2))
        return result


def likelihoods() -> Images:
    """Return noisy likelihoods of a walker, one image for each body height."""
    rng = np.random.default_rng(0)
    drawn = render_silhouette(0.2, 0.0, 86.0)
    rows, columns = GRID.image_shape
    image = np.zeros((rows, columns), np.uint8)
    y, x = (rows - drawn.shape[0]) // 2, (columns - drawn.shape[1]) // 2
    image[y : y + drawn.shape[0], max(x, 0) : max(x, 0) + drawn.shape[1]] = drawn[:, :columns]
    noise = rng.integers(0, 256, (SCALES, rows, columns))
    return np.where(rng.random(noise.shape) < 0.3, noise, image).astype(np.uint8)


def templates(count: int) -> dict[str, Images]:
    """Return the banks of one size."""
    walk, oblique = (render_cycle(np.arange(count) / count, way) for way in (0.0, OBLIQUE))
    turns = 16 if count % 16 == 0 else 10 if count % 10 == 0 else 1
    phases = np.arange(count // turns) / (count // turns)
    views = [render_cycle(phases, 2 * np.pi * k / turns) for k in range(turns)]
    return {
        'binary': np.where(walk > 127, 255, 0).astype(np.uint8),
        'soft': quantize(walk, 8),
        'oblique': quantize(oblique, 8),
        'views': quantize(np.concatenate(views), 8),
    }


def cost(action: Callable[[], object]) -> float:
    """Return the milliseconds of one call, of the processor time of this thread."""
    started = time.thread_time()
    action()
    return 1e3 * (time.thread_time() - started)


def equal_results(banks: dict[str, Images], images: Images) -> bool:
    """Tell whether all kernels give the same bits, on a part of the templates and windows."""
    small = images[:1]
    same = True
    for name, bank in banks.items():
        some = bank[:: max(1, len(bank) // 8)]
        kernels: list[Any] = [Ready(kind, some, GRID) for kind in KERNELS.values()]
        kernels.append(Naive(some, GRID))
        if name == 'binary':
            kernels.append(MatrixProduct(some, GRID))
        expected = Reference(some, GRID).common_area(small)
        same &= all(np.array_equal(expected, kernel.common_area(small)) for kernel in kernels)
    full = Ready(EventKernel, banks['binary'], GRID).common_area(images)
    return bool(
        same and np.array_equal(full, MatrixProduct(banks['binary'], GRID).common_area(images))
    )


def measure_kernels(repeats: int) -> dict[str, Any]:
    """Time all kernels at all sizes."""
    images = likelihoods()
    runs: dict[tuple[str, int], Callable[[], object]] = {}
    parts: dict[tuple[str, int], float] = {}
    events: dict[str, dict[str, int]] = {name: {} for name in KINDS}
    different: dict[str, dict[str, int]] = {name: {} for name in KINDS}
    megabytes: dict[str, float] = {}
    additions: dict[str, float] = {}
    equal = True
    for count in COUNTS:
        banks = templates(count)
        equal &= equal_results(banks, images)
        for name, bank in banks.items():
            ready = Ready(EventKernel, bank, GRID)
            program = ready.kernel.program  # type: ignore[attr-defined]
            events[name][str(count)] = len(program.source)
            different[name][str(count)] = ready.kernel.rows
            label = KINDS[name]
            coded = sum(array.nbytes for array in vars(program).values())
            megabytes[f'{label} {count}'] = round((coded + ready.matrix.nbytes) / 2**20, 2)
            runs[label, count] = partial(ready.rows, images)
        product = MatrixProduct(np.unique(banks['binary'], axis=0), GRID)
        runs['gemm', count] = partial(product.common_area, images)
        # The slow kernels treat the windows one by one: a part of them tells the time of all.
        windows = WindowGrid(96, 64, 1, max(1, min(11, SLOW // (count * 11000))), 2)
        rows, columns = windows.image_shape
        part = np.ascontiguousarray(images[:1, :rows, :columns])
        full = np.maximum(banks['soft'], 1)
        access = Ready(DirectAccessTableKernel, banks['soft'], windows)
        additions[str(count)] = round(access.additions(part), 1)
        for label, slow in (
            ('reference', Reference(banks['soft'], windows)),
            ('direct_access_table', access),
            ('table_no_black', Ready(DirectAccessTableKernel, full, windows)),
            ('naive', Naive(banks['soft'], windows)),
        ):
            runs[label, count] = partial(slow.common_area, part)
            parts[label, count] = SCALES * GRID.rows * GRID.columns / windows.columns
    times: dict[tuple[str, int], list[float]] = {key: [] for key in runs}
    for action in runs.values():
        action()
    # All sizes of one kind in turn: those of all kinds would drive each other out of the caches.
    for label in dict.fromkeys(label for label, _ in runs):
        heavy = label == 'gemm' or (label, COUNTS[0]) in parts
        for _ in range(max(3, repeats // 10) if heavy else repeats):
            for count in COUNTS:
                runs[label, count]()
                times[label, count].append(cost(runs[label, count]))
    table: dict[str, dict[str, float]] = {}
    for (label, count), values in times.items():
        middle = float(np.median(values)) * parts.get((label, count), 1.0)
        table.setdefault(label, {})[str(count)] = round(middle, 4)
    return {
        'ms': table,
        'events': events,
        'different': different,
        'additions': additions,
        'megabytes': megabytes,
        'equal': equal,
    }


def measure_updates(bank: TemplateBank, repeats: int) -> dict[str, dict[str, float]]:
    """Time whole updates by kernel, number of templates and what is searched."""
    # Off the profile, whose two halves of a stride are alike.
    single = TemplateBank(bank.templates[1:2], bank.azimuth[1:2], bank.builds[1:2], bank.fill)
    found: dict[str, dict[str, float]] = {}
    for kernel in KERNELS:
        for some in (single, bank):
            count = some.sequences * some.phases
            few = min(repeats, 40) if kernel != 'events' else repeats
            usual = MatchingConfig(kernel=kernel)
            for what, config in (
                ('all', replace(usual, scale_reach=2, shift_reach=5)),
                ('usual', usual),
            ):
                took = measure_update(SequenceMatcher(some, config), few)
                found.setdefault(kernel, {})[f'{count} {what}'] = took
    return found


def measure_update(matcher: SequenceMatcher, repeats: int) -> float:
    """Return the median time of an update, the first 20 of a walk left out."""
    cv2.setNumThreads(1)
    rng = np.random.default_rng(0)
    times = []
    for number in range(repeats + 20):
        drawn = render_silhouette(0.95 * number / 30, 0.2, 120.0)
        image = np.zeros((240, 320), np.uint8)
        image[40 : 40 + drawn.shape[0], 100 : 100 + drawn.shape[1]] = drawn
        box = Box.around(image > 127)
        likelihood = np.where(rng.random(image.shape) < 0.2, 255 - image, image).astype(np.uint8)
        track = TrackResult(10**9 + number * 10**9 // 30, 1, box, likelihood, 1.0)
        times.append(cost(partial(matcher.add_frame, track, (320, 240))))
    return round(float(np.median(times[20:])), 3)


def draw(table: dict[str, dict[str, float]]) -> None:
    """Draw times against the number of templates."""
    import matplotlib

    matplotlib.use('Agg')
    import matplotlib.pyplot as plt

    figure, axis = plt.subplots(figsize=(5.2, 3.6))
    for label, values in table.items():
        axis.loglog([int(k) for k in values], list(values.values()), 'o-', ms=3, label=label)
    axis.set_xlabel('templates')
    axis.set_ylabel('ms for 605 windows of 96 x 64')
    axis.legend(fontsize=7)
    axis.grid(alpha=0.3)
    figure.tight_layout()
    figure.savefig(ROOT / 'docs' / 'images' / 'matching_scaling.png', dpi=80)


def bars(report: dict[str, Any]) -> bool:
    """Print what is promised, and return whether it holds."""
    ms, update = report['ms'], report['update_ms']
    events, gemm, table = ms['events'], ms['gemm'], ms['direct_access_table']
    bars = {'events': 1.4, 'events_soft': 1.9, 'events_oblique': 2.2, 'events_views': 3.6}
    return all([
        *(holds(f'{name}, 960 over 30', ms[name]['960'] / ms[name]['30'], bar)
          for name, bar in bars.items()),
        holds('direct_access_table, 960 over 30', table['960'] / table['30'], 8.0),
        holds('gemm over events, 30', gemm['30'] / events['30'], 10.0, least=True),
        holds('gemm over events, 960', gemm['960'] / events['960'], 50.0, least=True),
        holds('update, 480 templates, ms', update['events']['480 all'], 4.0),
        holds('update, table, 30 templates, ms', update['direct_access_table']['30 all'], 50.0),
    ])  # fmt: skip


def main() -> int:
    """Measure, print, and say whether what is promised holds."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument('--json', type=Path, help='write the figures here')
    parser.add_argument('--plots', action='store_true', help='draw the figure of the docs')
    parser.add_argument('--repeats', type=int, default=61)
    arguments = parser.parse_args()
    report = measure_kernels(arguments.repeats)
    report['update_ms'] = measure_updates(default_bank(), arguments.repeats)
    for label, values in report['ms'].items():
        print(f'{label:20s}', *(f'{k:>4s}: {v:9.3f}' for k, v in values.items()))
    for name in KINDS:
        print(name, 'events', report['events'][name], 'different', report['different'][name])
    print('direct_access_table, templates that a lookup changes', report['additions'])
    for label, updates in report['update_ms'].items():
        print(f'update {label:20s}', *(f'{k}: {v:.2f}' for k, v in updates.items()))
    print('equal', report['equal'])
    fine = bars(report) and report['equal']
    if arguments.json:
        arguments.json.write_text(json.dumps(report, indent=1) + '\n')
    if arguments.plots:
        draw(report['ms'])
    return 0 if fine else 1


if __name__ == '__main__':
    sys.exit(run_tool('matching.py', main))

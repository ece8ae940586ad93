#!/usr/bin/env python3
# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
How well the standard bank fits real silhouettes.

For every frame of every set of true masks the best template at the best placement (dx, dy and
scale) is searched, and its Tanimoto similarity with the mask averaged over the frames: on the
template's own pixels, the mask averaged over each, as the matcher sees it::

    python benchmarks/bank_fit.py FOLDER [FOLDER ...]
"""

from __future__ import annotations

import argparse
import statistics
import sys
from collections import Counter
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from gait_segmentation.cli.tool import run_tool
from gait_segmentation.errors import SequenceError
from gait_segmentation.gait_model import TemplateBank, default_bank
from gait_segmentation.geometry import BodyFrame, Box, pixel_affine, template_to_image
from gait_tools.evaluation.report import aligned
from gait_tools.gait_model import BankSpec, build_bank

Float = NDArray[np.float32]

# The mean similarity that a good bank reaches, by the name of the set.
AIMS = {
    'side-left-normal': 0.86,
    'side-left-rucksack': 0.82,
    'lucia': 0.78,
    'hall': 0.75,
}
WORKING_HEIGHT = 128  # taller masks are scaled down to this
KEPT = 8  # templates that go on from the coarse to the fine search
FINE = 3  # samples a template pixel and direction, of which its mean is taken
_INVERSE = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP


def name_of(folder: Path) -> str:
    """Return the name of a set: that of its folder, or of the sequence whose masks it is."""
    folder = folder.resolve()
    return folder.parent.name if folder.name == 'masks' else folder.name


def prepare(mask: NDArray[np.uint8], outside: int = 0) -> tuple[Float, Float, Box] | None:
    """
    Return foreground and validity in 0..1, padded, and the person's box; None without one.

    :param outside: whether what lies outside of the picture is known (1) to be background.
    """
    person = (mask == 255).astype(np.uint8)
    box = Box.around(person)
    if box is None:
        return None
    pad = int(0.5 * box.height)
    sides = (pad, pad, pad, pad)
    person = cv2.copyMakeBorder(person, *sides, cv2.BORDER_CONSTANT, value=0)
    known = ((mask == 255) | (mask == 0)).astype(np.uint8)
    known = cv2.copyMakeBorder(known, *sides, cv2.BORDER_CONSTANT, value=outside)
    box = box.shifted(pad, pad)
    window = box.padded(0.45 * box.height, 0.25 * box.height)
    rows, columns = window.slices(person.shape[1], person.shape[0])
    person, known = person[rows, columns], known[rows, columns]
    box = box.shifted(-columns.start, -rows.start)
    factor = min(1.0, WORKING_HEIGHT / box.height)
    size = (round(person.shape[1] * factor), round(person.shape[0] * factor))
    true, valid = (
        cv2.resize(image.astype(np.float32), size, interpolation=cv2.INTER_AREA)
        for image in (person, known)
    )
    return true, valid, box.scaled(factor)


def similarity(true: Float, valid: Float, drawn: Float) -> float:
    """Return the Tanimoto similarity over the valid pixels."""
    common = float((np.minimum(true, drawn) * valid).sum())
    union = float((np.maximum(true, drawn) * valid).sum())
    return common / union if union else 0.0


def on_grid(images: Float, body: BodyFrame, bank: TemplateBank) -> Float:
    """Average (rows, columns, 2) mask and validity over the template's pixels."""
    rows, columns = bank.grid
    fine = (rows * FINE, columns * FINE)
    matrix = pixel_affine(template_to_image(body, *fine, bank.fill))
    warped = cv2.warpAffine(images, matrix, fine[::-1], flags=_INVERSE)
    return cv2.resize(warped, (columns, rows), interpolation=cv2.INTER_AREA)


def grid_similarity(images: Float, template: Float, body: BodyFrame, bank: TemplateBank) -> float:
    """Return the similarity as the matcher sees it: on the pixels of the template."""
    seen = on_grid(images, body, bank)
    return similarity(seen[..., 0], seen[..., 1], template)


def coarse(
    images: Float, box: Box, flat: Float, bank: TemplateBank
) -> list[tuple[float, int, BodyFrame]]:
    """Try all templates at a lattice of placements; return the best few."""
    best = np.full(len(flat), -1.0)
    where: list[BodyFrame | None] = [None] * len(flat)
    weight = images[..., 0].sum(axis=0)
    axis = float(np.interp(weight.sum() / 2, np.cumsum(weight), np.arange(1, len(weight) + 1)))
    for scale in (0.94, 1.0, 1.06):
        for dy in (-0.03, 0.0, 0.03):
            for dx in (-0.09, -0.06, -0.03, 0.0, 0.03, 0.06, 0.09):
                body = BodyFrame(
                    axis + dx * box.height, box.center_y + dy * box.height, scale * box.height
                )
                seen = on_grid(images, body, bank)
                known = seen[..., 1].ravel()
                person = seen[..., 0].ravel() * known
                common = flat @ person
                score = common / (person.sum() + flat @ known - common + 1e-9)
                better = score > best
                best[better] = score[better]
                for k in np.flatnonzero(better):
                    where[k] = body
    order = np.argsort(best)[::-1][:KEPT]
    return [(float(best[k]), int(k), where[k]) for k in order if where[k] is not None]


def refine(
    images: Float, template: Float, start: BodyFrame, bank: TemplateBank
) -> tuple[float, BodyFrame]:
    """Climb to the best placement of one template."""
    body = start
    best = grid_similarity(images, template, body, bank)
    moves = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
    for step in (0.02, 0.01, 0.005, 0.0025):
        improved = True
        while improved:
            improved = False
            for dx, dy, ds in moves:
                reach = step * body.height
                trial = BodyFrame(
                    body.center_x + dx * reach,
                    body.center_y + dy * reach,
                    body.height + ds * reach,
                )
                score = grid_similarity(images, template, trial, bank)
                if score > best:
                    best, body, improved = score, trial, True
    return best, body


def fit_frame(
    mask: NDArray[np.uint8], bank: TemplateBank, flat: Float, outside: int = 0
) -> tuple[float, int, BodyFrame] | None:
    """Return similarity, template and place of the best fit to one mask, None for an empty one."""
    prepared = prepare(mask, outside)
    if prepared is None:
        return None
    true, valid, box = prepared
    images = np.stack([true, valid], axis=-1)
    fits = [
        (*refine(images, flat[tried].reshape(bank.grid), start, bank), tried)
        for _, tried, start in coarse(images, box, flat, bank)
    ]
    best, body, index = max(fits, key=lambda fit: fit[0])
    return best, index, body


def fit_set(folder: Path, bank: TemplateBank, every: int = 1) -> list[tuple[float, str]]:
    """Return similarity and build of the best fits to a folder of masks."""
    flat = bank.templates.reshape(-1, bank.grid[0] * bank.grid[1]).astype(np.float32) / 255
    # Silhouettes that are cut out reach the border of their pictures without being cut off.
    outside = int(folder.resolve().name != 'masks')
    files = sorted(folder.glob('*.png'))[::every]
    masks = (cv2.imread(str(file), cv2.IMREAD_GRAYSCALE) for file in files)
    fits = [fit_frame(mask, bank, flat, outside) for mask in masks]
    return [(fit[0], bank.builds[fit[1] // bank.phases]) for fit in fits if fit is not None]


def main(argv: list[str] | None = None) -> None:
    """Print the table of fits."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0].strip())
    parser.add_argument(
        'sets', nargs='+', type=Path, metavar='FOLDER', help='of masks, such as SEQUENCE_DIR/masks'
    )
    parser.add_argument('--bank', help='a bank file instead of the standard bank')
    parser.add_argument('--builds', help='builds of a bank to draw instead of the standard bank')
    parser.add_argument('--every', type=int, default=1, help='take every n-th frame only')
    options = parser.parse_args(argv)
    if options.bank:
        bank = TemplateBank.load(options.bank)
    elif options.builds:
        bank = build_bank(BankSpec(builds=options.builds))
    else:
        bank = default_bank()
    found = {name_of(folder): fit_set(folder, bank, options.every) for folder in options.sets}
    if not any(found.values()):
        raise SequenceError('no folder holds masks')
    rows = [['set', 'frames', 'similarity', 'worst', 'aim', 'builds']]
    for name, fits in found.items():
        if fits:
            values = [value for value, _ in fits]
            builds = Counter(build for _, build in fits)
            used = ', '.join(f'{build} {count}' for build, count in sorted(builds.items()))
            mean = f'{statistics.fmean(values):.4f}'
            aim = f'{AIMS[name]:.2f}' if name in AIMS else ''
            rows.append([name, str(len(fits)), mean, f'{min(values):.3f}', aim, used])
    count = bank.sequences * bank.phases
    print(f'{count} templates of {bank.grid[0]} x {bank.grid[1]}; mean of the best fits')
    print(aligned(rows))


if __name__ == '__main__':
    sys.exit(run_tool('bank_fit.py', main))

#!/usr/bin/env python3
# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
How well the standard bank fits real silhouettes.

For every frame of every set of true masks the best template at the best placement (dx, dy and
scale) is searched, and its Tanimoto similarity with the mask averaged over the frames: ``soft``
on the template's own pixels, the mask averaged over each, as the matcher sees it; ``hard`` in the
image, both thresholded; ``image`` in the image with soft template against sharp mask::

    python benchmarks/bank_fit.py FOLDER [FOLDER ...]
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from gait_segmentation.cli.tool import run_tool
from gait_segmentation.errors import SequenceError
from gait_segmentation.gait_model import BankSpec, TemplateBank, build_bank, default_bank
from gait_segmentation.geometry import BodyFrame, Box, pixel_affine, template_to_image

Float = NDArray[np.float32]

# The mean similarity (soft) that a good bank reaches, by the name of the set.
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


def draw(template: NDArray[np.uint8], body: BodyFrame, fill: float, shape: tuple) -> Float:
    """Return the template warped into an image of the given shape, 0..1."""
    matrix = pixel_affine(template_to_image(body, *template.shape, fill))
    warped = cv2.warpAffine(template, matrix, (shape[1], shape[0]), flags=cv2.INTER_LINEAR)
    return warped.astype(np.float32) / 255


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
) -> dict | None:
    """Return the best fit of the bank to one mask, None for an empty one."""
    prepared = prepare(mask, outside)
    if prepared is None:
        return None
    true, valid, box = prepared
    images = np.stack([true, valid], axis=-1)
    best, index, body = -1.0, 0, BodyFrame(0.0, 0.0, 1.0)
    for _, tried, start in coarse(images, box, flat, bank):
        score, placed = refine(images, flat[tried].reshape(bank.grid), start, bank)
        if score > best:
            best, index, body = score, tried, placed
    drawn = draw(bank.templates.reshape(-1, *bank.grid)[index], body, bank.fill, true.shape)
    sharp = (true >= 0.5).astype(np.float32)
    return {
        'soft': best,
        'hard': similarity(sharp, valid, (drawn >= 0.5).astype(np.float32)),
        'image': similarity(sharp, valid, drawn),
        'sequence': index // bank.phases,
        'phase': index % bank.phases,
        'body': body,
    }


def fit_set(folder: Path, bank: TemplateBank, every: int = 1) -> dict | None:
    """Return the fits to a folder of masks, None if it has none."""
    files = sorted(folder.glob('*.png'))[::every]
    if not files:
        return None
    flat = bank.templates.reshape(-1, bank.grid[0] * bank.grid[1]).astype(np.float32) / 255
    # Silhouettes that are cut out reach the border of their pictures without being cut off.
    outside = int(folder.resolve().name != 'masks')
    masks = (cv2.imread(str(file), cv2.IMREAD_GRAYSCALE) for file in files)
    fits = [fit_frame(mask, bank, flat, outside) for mask in masks]
    found = [fit for fit in fits if fit is not None]
    used: dict[str, int] = {}
    for fit in found:
        build = bank.builds[fit['sequence']]
        used[build] = used.get(build, 0) + 1
    return {
        'frames': len(found),
        'soft': float(np.mean([fit['soft'] for fit in found])),
        'hard': float(np.mean([fit['hard'] for fit in found])),
        'image': float(np.mean([fit['image'] for fit in found])),
        'worst': float(np.min([fit['soft'] for fit in found])),
        'builds': used,
    }


def main(argv: list[str] | None = None) -> int:
    """Print the table of fits."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0].strip())
    parser.add_argument(
        'sets', nargs='+', type=Path, metavar='FOLDER', help='of masks, such as SEQUENCE_DIR/masks'
    )
    parser.add_argument('--bank', help='a bank file instead of the standard bank')
    parser.add_argument('--builds', help='builds of a bank to draw instead of the standard bank')
    parser.add_argument('--every', type=int, default=1, help='take every n-th frame only')
    parser.add_argument('--json', action='store_true', help='print JSON instead of a table')
    options = parser.parse_args(argv)
    if options.bank:
        bank = TemplateBank.load(options.bank)
    elif options.builds:
        bank = build_bank(BankSpec(builds=options.builds))
    else:
        bank = default_bank()
    if not options.json:
        count = bank.sequences * bank.phases
        print(f'{count} templates of {bank.grid[0]} x {bank.grid[1]}; mean of the best fits')
        print(f'{"set":20} frames    soft    hard   image   worst   aim  builds', flush=True)
    results = {}
    for folder in options.sets:
        row = fit_set(folder, bank, options.every)
        if row is None:
            print(f'{folder} is skipped: it holds no masks', file=sys.stderr)
            continue
        name = name_of(folder)
        aim = AIMS.get(name)
        results[name] = {**row, 'aim': aim}
        if not options.json:
            wanted = '' if aim is None else f'{aim:.2f}'
            builds = ', '.join(f'{build} {n}' for build, n in sorted(row['builds'].items()))
            print(
                f'{name:20} {row["frames"]:6} {row["soft"]:7.4f} {row["hard"]:7.4f} '
                f'{row["image"]:7.4f} {row["worst"]:7.3f} {wanted:>5}  {builds}',
                flush=True,
            )
    if not results:
        raise SequenceError('no folder holds masks')
    if options.json:
        print(json.dumps(results, indent=2))
    return 0


if __name__ == '__main__':
    sys.exit(run_tool('bank_fit.py', main))

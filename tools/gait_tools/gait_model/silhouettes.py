# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Banks from real silhouettes: reading, registration and templates.

The practice is that of the gait silhouette volumes of Makihara and colleagues: silhouettes are
scaled by their smoothed height and centred on their smoothed median column.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import BankError, SequenceError
from gait_segmentation.files.image_files import IMAGE_SUFFIXES, images_in, read_image
from gait_segmentation.gait_model.bank import TemplateBank, quantize
from gait_segmentation.geometry import BodyFrame, pixel_affine, template_to_image
from gait_tools.gait_model.builder import BankSpec
from gait_tools.gait_model.gait_cycle import cycle_templates, find_contacts, find_step, smooth
from gait_tools.gait_model.render import median_column

_FINE = 3  # samples a template pixel and direction, of which its mean is taken
_PROFILE = 0.3  # sine of the largest angle between a profile view and the exact side view


def read_silhouettes(folder: str | os.PathLike[str]) -> NDArray[np.uint8]:
    """Read a walk, (N, height, width) uint8 0/255; cut out ones are laid on one ground."""
    images = read_masks(folder)
    paths = [path for path, _ in images]
    listed = images_in(Path(folder))
    for path in listed[listed.index(paths[0]) : listed.index(paths[-1])]:
        if path not in paths:
            raise BankError(f'{path} is empty, and those before and after it are not')
    masks = [mask for _, mask in images]
    if len({mask.shape for mask in masks}) == 1:
        return np.stack(masks)
    if all(mask[0].any() and mask[-1].any() for mask in masks):
        return _on_one_ground(masks)
    path, mask = next(each for each in images if each[1].shape != masks[0].shape)
    raise BankError(
        f'{path} is {mask.shape[1]} x {mask.shape[0]}, the silhouettes before it are '
        f'{masks[0].shape[1]} x {masks[0].shape[0]}'
    )


def read_masks(folder: str | os.PathLike[str]) -> list[tuple[Path, NDArray[np.uint8]]]:
    """Read files and masks, uint8 0/255, of any sizes; images without a person are left out."""
    folder = Path(folder)
    if not folder.is_dir():
        raise BankError(f'{folder} is not a folder of silhouettes')
    files = images_in(folder)
    if not files:
        endings = ', '.join(IMAGE_SUFFIXES)
        raise BankError(f'no images in {folder}: expected files ending in {endings}')
    found = []
    brightest = 0
    for file in files:
        try:
            image = read_image(file, cv2.IMREAD_GRAYSCALE)
        except SequenceError as error:
            raise BankError(str(error)) from error
        if image[:: max(image.shape[0] - 1, 1), :: max(image.shape[1] - 1, 1)].min() >= 128:
            raise BankError(f'{file} is white in all corners: silhouettes must be white on black')
        brightest = max(brightest, int(image.max()))
        if image.max() >= 128:
            found.append((file, np.where(image >= 128, 255, 0).astype(np.uint8)))
    if not found:
        raise BankError(
            f'{folder} holds no silhouettes: no grey value of 128 or more, at most {brightest}'
        )
    return found


def _on_one_ground(masks: list[NDArray[np.uint8]]) -> NDArray[np.uint8]:
    """Lay silhouettes of many sizes into images of one, by their feet and median columns."""
    height = max(mask.shape[0] for mask in masks)
    half = max(mask.shape[1] for mask in masks)
    result = np.zeros((len(masks), height, 2 * half), np.uint8)
    for image, mask in zip(result, masks, strict=True):
        left = half - round(median_column(mask))
        image[height - mask.shape[0] :, left : left + mask.shape[1]] = mask
    return result


def register_silhouettes(
    masks: NDArray[np.uint8], grid: tuple[int, int], fill: float, window: float = 15.0
) -> NDArray[np.uint8]:
    """Bring silhouettes to a grid, of which the height, smoothed over a window, fills a share."""
    tops, bottoms, medians = [], [], []
    for mask in masks:
        rows = np.flatnonzero(mask.any(axis=1))
        tops.append(float(rows[0]))
        bottoms.append(float(rows[-1] + 1))
        medians.append(median_column(mask))
    top, bottom, axis = (smooth(np.array(values), window) for values in (tops, bottoms, medians))
    fine = (grid[0] * _FINE, grid[1] * _FINE)
    result = np.empty((len(masks), *grid), dtype=np.uint8)
    for k, mask in enumerate(masks):
        body = BodyFrame(axis[k], (top[k] + bottom[k]) / 2, bottom[k] - top[k])
        matrix = pixel_affine(template_to_image(body, *fine, fill * fine[0]))
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        warped = cv2.warpAffine(mask, matrix, fine[::-1], flags=flags)
        result[k] = cv2.resize(warped, (grid[1], grid[0]), interpolation=cv2.INTER_AREA)
    return result


@dataclass(frozen=True)
class SilhouetteSequence:
    """Silhouettes of a walker who keeps one direction, and the leg of the first contact."""

    masks: NDArray[np.uint8]
    azimuth: float
    name: str
    first_contact: str = 'right'

    def __post_init__(self) -> None:
        """Refuse an azimuth that is none."""
        if not math.isfinite(self.azimuth):
            raise BankError(f'azimuth must be a finite number, got {self.azimuth!r}')


def bank_from_silhouettes(
    sequences: Sequence[SilhouetteSequence],
    spec: BankSpec | None = None,
    *,
    mirror: bool = False,
    average: bool = False,
    progress: Callable[[], None] | None = None,
) -> TemplateBank:
    """Make a bank of walks, mirrored ones besides, or averaged by their direction."""
    spec = BankSpec() if spec is None else spec
    if not sequences:
        raise BankError('at least one sequence of silhouettes is needed, got none')
    grid = (spec.height, spec.width)
    templates, azimuths, names, notes = [], [], [], []
    for sequence in sequences:
        rough = register_silhouettes(sequence.masks, grid, spec.fill)
        try:
            step = find_step(rough, abs(math.sin(sequence.azimuth)) < _PROFILE)
            registered = register_silhouettes(sequence.masks, grid, spec.fill, 2 * step)
            cycle = find_contacts(registered, step)
        except BankError as error:
            raise BankError(f'{sequence.name}: {error}') from error
        first = 0.0 if sequence.first_contact == 'right' else 0.5
        templates.append(cycle_templates(registered, cycle, spec.phases, first))
        azimuths.append(sequence.azimuth)
        names.append(sequence.name)
        if mirror:
            other = np.ascontiguousarray(registered[:, :, ::-1])
            templates.append(cycle_templates(other, cycle, spec.phases, first + 0.5))
            azimuths.append(math.pi - sequence.azimuth)
            names.append(sequence.name)
        notes.append(f'{sequence.name}: {len(sequence.masks)} frames, step {step:.2f} frames')
        if progress is not None:
            progress()
    wrapped = [math.pi - (math.pi - azimuth) % (2 * math.pi) for azimuth in azimuths]
    if average:
        alike: dict[int, list[int]] = {}
        for k, azimuth in enumerate(wrapped):
            alike.setdefault(round(math.degrees(azimuth)) % 360, []).append(k)
        wrapped = [wrapped[each[0]] for each in alike.values()]
        means = (np.mean([templates[k] for k in each], axis=0) for each in alike.values())
        templates = [np.rint(mean).astype(np.uint8) for mean in means]
        names = ['average'] * len(templates)
    return TemplateBank(
        quantize(np.stack(templates), spec.levels),
        np.array(wrapped, dtype=np.float32),
        tuple(names),
        spec.fill,
        {'source': 'silhouettes', 'sequences': '; '.join(notes)},
    )

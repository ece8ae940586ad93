# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Banks from real silhouettes: reading, registration, the rhythm of the walk, and templates.

The practice is that of Makihara and colleagues: silhouettes are scaled by their smoothed height,
centred on their smoothed median column, and the period is where their autocorrelation peaks.  In
profile the two halves of a stride look alike, so the first peak is a step.
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
from gait_segmentation.gait_model.bank import TemplateBank, quantize
from gait_segmentation.geometry import BodyFrame, pixel_affine, template_to_image
from gait_segmentation.inputs.folder import IMAGE_SUFFIXES, images_in, load_image
from gait_tools.gait_model.builder import BankSpec
from gait_tools.gait_model.render import median_column

SHORTEST_STEP, LONGEST_STEP = 5, 60  # frames
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
    found, brightest = [], 0
    for file in files:
        try:
            image = load_image(file, cv2.IMREAD_GRAYSCALE)
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


@dataclass(frozen=True)
class Cycle:
    """Frames from one heel contact to the next (half a stride), and all contacts, ascending."""

    step: float
    contacts: NDArray[np.float64]

    def phase(self, frame: NDArray[np.float64], first: float = 0.0) -> NDArray[np.float64]:
        """Return the growing phase of frames in strides, that of the first contact being given."""
        steps = np.arange(len(self.contacts), dtype=np.float64)
        inside = np.interp(frame, self.contacts, steps)
        before = np.minimum(frame - self.contacts[0], 0.0) / self.step
        after = np.maximum(frame - self.contacts[-1], 0.0) / self.step
        return first + (inside + before + after) / 2


def smooth(values: NDArray[np.float64], window: float) -> NDArray[np.float64]:
    """Average over a centred window that shrinks at the ends."""
    half = min(max(round(window / 2), 0), (len(values) - 1) // 2)
    sums = np.concatenate([[0.0], np.cumsum(values)])
    index = np.arange(len(values))
    reach = np.minimum(half, np.minimum(index, len(values) - 1 - index))
    return (sums[index + reach + 1] - sums[index - reach]) / (2 * reach + 1)


def autocorrelation(registered: NDArray[np.uint8], longest: int) -> NDArray[np.float64]:
    """Return the normalised autocorrelation of registered silhouettes at lags from 0 on."""
    flat = registered.reshape(len(registered), -1).astype(np.float64)
    flat = flat - flat.mean(axis=0)
    product = flat @ flat.T
    energy = np.diag(product)
    result = np.empty(longest + 1)
    for lag in range(longest + 1):
        end = len(flat) - lag
        scale = math.sqrt(float(energy[:end].sum() * energy[lag:].sum()))
        result[lag] = float(np.trace(product, offset=lag)) / scale if scale > 0 else 0.0
    return result


def _vertex(values: NDArray[np.float64], at: int) -> float:
    """Return the place of a peak between samples, by the parabola through three of them."""
    if not 0 < at < len(values) - 1:
        return float(at)
    left, middle, right = values[at - 1 : at + 2]
    bend = left - 2 * middle + right
    return at + (0.5 * float((left - right) / bend) if bend < 0 else 0.0)


def find_step(registered: NDArray[np.uint8], profile: bool = True) -> float:
    """Return the frames a step; in profile both halves of a stride look alike."""
    longest = min(2 * LONGEST_STEP, len(registered) - 4)
    if longest < 2 * SHORTEST_STEP:
        raise BankError(
            f'a sequence needs at least {2 * SHORTEST_STEP + 4} silhouettes, got {len(registered)}'
        )
    values = autocorrelation(registered, longest)
    inner = np.arange(SHORTEST_STEP, longest)
    peaks = inner[(values[inner] >= values[inner - 1]) & (values[inner] > values[inner + 1])]
    if peaks.size == 0 or values[peaks].max() < 0.1:
        raise BankError(
            f'{len(registered)} silhouettes show no period: one stride at least of a person '
            'walking past is needed'
        )
    # In profile the peaks at a step and at a stride are about as high; the first one is meant.
    strong = peaks[values[peaks] >= (0.5 if profile else 0.8) * values[peaks].max()]
    step = _vertex(values, int(strong[0])) / (1 if profile else 2)
    twice = round(2 * step)
    near = [k for k in peaks if abs(int(k) - twice) <= max(2, round(0.2 * step))]
    if near:
        # The stride's peak is the same period measured over twice the time.
        step = _vertex(values, int(max(near, key=lambda k: values[k]))) / 2
    if step > LONGEST_STEP:
        raise BankError(
            f'a step must take at most {LONGEST_STEP} frames, the silhouettes repeat after '
            f'{step:.1f}: is the frame rate very high?'
        )
    return step


def step_width(registered: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Return how wide the legs are apart: the spread of the lowest fifth, in columns."""
    rows = np.flatnonzero(registered.any(axis=(0, 2)))
    lowest = rows[-1] + 1 - max((rows[-1] + 1 - rows[0]) // 5, 1)
    mass = registered[:, lowest : rows[-1] + 1].sum(axis=1, dtype=np.float64)
    columns = np.arange(registered.shape[2], dtype=np.float64)
    total = np.maximum(mass.sum(axis=1), 1e-9)
    mean = (mass @ columns) / total
    spread = (mass * (columns - mean[:, None]) ** 2).sum(axis=1) / total
    return np.sqrt(spread)


def find_contacts(registered: NDArray[np.uint8], step: float) -> Cycle:
    """Find the heel contacts: where the legs are farthest apart."""
    width = smooth(step_width(registered), step / 8)
    frames = np.arange(len(width))
    wave = np.sum((width - width.mean()) * np.exp(-2j * np.pi * frames / step))
    # The wave's crests are at first + k * step; each contact is sought round its crest.
    first = (-float(np.angle(wave)) / (2 * np.pi) * step) % step
    contacts = []
    for crest in np.arange(first, len(width) - 0.5, step):
        low = max(math.ceil(crest - step / 4), 0)
        high = min(math.floor(crest + step / 4) + 1, len(width))
        peak = low + int(np.argmax(width[low:high]))
        inside = low < peak < high - 1
        contacts.append(_vertex(width, peak) if inside else float(crest))
    if len(contacts) < 3:
        raise BankError(
            f'{len(registered)} silhouettes with a step every {step:.1f} frames hold fewer than '
            'three heel contacts; at least one whole stride is needed'
        )
    return Cycle(step, np.array(contacts))


def _moment(registered: NDArray[np.float64], frame: float) -> NDArray[np.float64]:
    """Interpolate linearly between two frames."""
    before = min(math.floor(frame), len(registered) - 2)
    share = frame - before
    return (1 - share) * registered[before] + share * registered[before + 1]


def cycle_templates(
    registered: NDArray[np.uint8], cycle: Cycle, phases: int, first: float = 0.0
) -> NDArray[np.uint8]:
    """Resample a sequence to the phases of one stride; several strides are averaged."""
    frames = np.arange(len(registered), dtype=np.float64)
    phase = cycle.phase(frames, first)
    values = registered.astype(np.float64)
    result = np.empty((phases, *registered.shape[1:]), dtype=np.uint8)
    for k in range(phases):
        low = math.ceil(phase[0] - k / phases - 1e-9)
        high = math.floor(phase[-1] - k / phases + 1e-9)
        if high < low:
            raise BankError(f'the silhouettes do not cover phase {k / phases:.2f} of a stride')
        moments = np.interp(np.arange(low, high + 1) + k / phases, phase, frames)
        mean = np.mean([_moment(values, moment) for moment in moments], axis=0)
        result[k] = np.floor(mean + 0.5).astype(np.uint8)
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

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Making a bank from sequences of real silhouettes."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import BankError
from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.gait_model.builder import BankSpec, quantize
from gait_segmentation.gait_model.silhouettes import (
    Cycle,
    find_contacts,
    find_step,
    register_silhouettes,
)

__all__ = ['SilhouetteSequence', 'bank_from_silhouettes', 'cycle_templates']

_PROFILE = 0.3  # sine of the largest angle between a profile view and the exact side view


@dataclass(frozen=True)
class SilhouetteSequence:
    """
    Consecutive silhouettes of one walker who keeps one direction.

    Heel contacts are found by the width of the legs, which works from any direction but the
    exact front and back.

    :param masks: (N, height, width) uint8, 255 inside, at least one stride.
    :param azimuth: walking direction in radians, as in ``TemplateBank``.
    :param name: the build's name in the bank.
    :param first_contact: leg of the first heel contact, ``'right'`` or ``'left'``.  In profile
        it cannot be seen; a wrong one shifts the phase by half a stride.
    """

    masks: NDArray[np.uint8]
    azimuth: float
    name: str
    first_contact: str = 'right'

    def __post_init__(self) -> None:
        """Refuse what cannot be used."""
        if self.masks.ndim != 3 or self.masks.dtype != np.uint8:
            raise BankError(
                f'silhouettes must be (frames, height, width) uint8, got {self.masks.shape} '
                f'{self.masks.dtype}'
            )
        empty = np.flatnonzero(~self.masks.any(axis=(1, 2)))
        if empty.size:
            raise BankError(f'silhouette {empty[0]} of {self.name!r} is empty')
        if self.first_contact not in ('right', 'left'):
            raise BankError(f"first_contact must be 'right' or 'left', got {self.first_contact!r}")
        if not math.isfinite(self.azimuth):
            raise BankError(f'azimuth must be a finite number, got {self.azimuth!r}')


def _moment(registered: NDArray[np.float64], frame: float) -> NDArray[np.float64]:
    """Interpolate linearly between two frames."""
    before = min(math.floor(frame), len(registered) - 2)
    share = frame - before
    return (1 - share) * registered[before] + share * registered[before + 1]


def cycle_templates(
    registered: NDArray[np.uint8], cycle: Cycle, phases: int, first: float = 0.0
) -> NDArray[np.uint8]:
    """
    Resample a sequence to the phases of one stride; several strides are averaged.

    :param registered: (N, rows, columns) uint8.
    :param cycle: its rhythm.
    :param phases: number of phases.
    :param first: phase of the first heel contact.
    :returns: (phases, rows, columns) uint8, soft where strides differ.
    :raises BankError: if a phase is not in the sequence.
    """
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


def bank_from_silhouettes(
    sequences: Sequence[SilhouetteSequence],
    spec: BankSpec | None = None,
    *,
    mirror: bool = False,
    progress: Callable[[], None] | None = None,
) -> TemplateBank:
    """
    Make a bank with one sequence of templates for every sequence of silhouettes.

    :param sequences: the silhouettes.
    :param spec: grid, fill, phases and levels; its builds, azimuths and elevation do not matter.
    :param mirror: add the mirror image of every sequence, which walks the other way with right
        and left leg exchanged.
    :param progress: called after each sequence.
    :raises BankError: if there is no sequence, or one is too short or shows no period.
    """
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
    return TemplateBank(
        quantize(np.stack(templates), spec.levels),
        np.array(wrapped, dtype=np.float32),
        tuple(names),
        spec.fill,
        {'source': 'silhouettes', 'sequences': '; '.join(notes)},
    )

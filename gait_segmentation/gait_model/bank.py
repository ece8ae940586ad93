# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The standard gait model: silhouettes ordered by view, build and phase."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import BankError
from gait_segmentation.gait_model.extents import extents
from gait_segmentation.gait_model.storage import read_bank, write_bank

__all__ = ['TemplateBank']


@dataclass(frozen=True, eq=False)
class TemplateBank:
    """
    Templates of V sequences (view x build) with P phases each.

    :param templates: (V, P, H, W) uint8, 255 inside, soft edge.  The body's height takes ``fill``
        of the H rows, centred; the body's axis (median column, smoothed over the cycle) is the
        middle column.
    :param azimuth: (V,) float32, walking direction in radians: 0 to the right in the image, pi/2
        away from the camera, pi to the left, -pi/2 towards the camera.
    :param builds: V names, e.g. ``'average'``, ``'coat'``; sequences of one build differ in view.
    :param fill: share of the rows the body takes.
    :param provenance: how the bank was made, name -> text.

    Phase p of every sequence is at p / P of the stride, 0 = heel contact of the *right* leg, so
    that phases agree between neighbouring views.

    Equal is only the same bank, so that what is derived from it can be kept.

    :raises BankError: if shapes, types or values do not fit together.
    """

    templates: NDArray[np.uint8]
    azimuth: NDArray[np.float32]
    builds: tuple[str, ...]
    fill: float
    provenance: dict[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check that the parts fit together."""
        if self.templates.ndim != 4 or self.templates.dtype != np.uint8:
            raise BankError(
                'templates must be (sequences, phases, height, width) uint8, got '
                f'{self.templates.shape} {self.templates.dtype}'
            )
        if 0 in self.templates.shape:
            raise BankError(f'a bank must not be empty, got shape {self.templates.shape}')
        sequences = len(self.templates)
        if self.azimuth.shape != (sequences,) or len(self.builds) != sequences:
            raise BankError(
                f'{sequences} sequences need as many azimuths and builds, got '
                f'{self.azimuth.shape} and {len(self.builds)}'
            )
        if self.azimuth.dtype != np.float32 or not np.isfinite(self.azimuth).all():
            raise BankError(
                f'azimuths must be finite float32, got {self.azimuth.dtype} {self.azimuth}'
            )
        if not 0 < self.fill <= 1:
            raise BankError(f'fill must be in (0, 1], got {self.fill}')

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> TemplateBank:
        """
        Read a bank from a file made by :meth:`save`.

        :raises BankError: if the file is missing, damaged, no bank or a bank of another version.
        """
        entries = read_bank(path)
        try:
            return cls(**entries)
        except BankError as error:
            raise BankError(f'{os.fspath(path)}: {error}') from error

    def save(self, path: str | os.PathLike[str]) -> None:
        """
        Write the bank to a file, replacing an old one in one step.

        :raises BankError: if the file cannot be written.
        """
        write_bank(
            path,
            {
                'templates': self.templates,
                'azimuth': self.azimuth,
                'builds': self.builds,
                'fill': self.fill,
                'provenance': self.provenance,
            },
        )

    @cached_property
    def extents(self) -> tuple[NDArray[np.int32], ...]:
        """Return the boxes of the templates, (V, P, 4) int32: their insides, and with the rim."""
        return extents(self.templates, (127, 0))

    @property
    def sequences(self) -> int:
        """Return V, the number of sequences."""
        return int(self.templates.shape[0])

    @property
    def phases(self) -> int:
        """Return P, the number of phases."""
        return int(self.templates.shape[1])

    @property
    def grid(self) -> tuple[int, int]:
        """Return (H, W) of the template grid."""
        return int(self.templates.shape[2]), int(self.templates.shape[3])

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The standard gait model: silhouettes ordered by view, build and phase, and its files.

Files are compressed ``.npz`` archives of plain arrays, read without pickle.  Entries: ``format``
(the text :data:`BANK_FORMAT`), ``version`` (:data:`BANK_VERSION`), ``templates``, ``azimuth``,
``builds``, ``fill`` and ``provenance`` (a JSON object of texts); of finer views
``finer_templates``, ``finer_azimuth`` and ``finer_builds``.
"""

from __future__ import annotations

import io
import json
import math
import os
import tokenize
import zipfile
import zlib
from dataclasses import dataclass, field
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import BankError
from gait_segmentation.files import write_file

BANK_FORMAT = 'gait_segmentation template bank'
BANK_VERSION = 2
LEAST_SIDE = 16
"""Rows and columns of the smallest grid that is drawn."""

_FINE_ROWS = 48  # outlines move by less than a row between phases, but all along their length
_MOST_PIXELS = (2**31 - 1) // 255  # sums over a template fit 32 bits
_VIEWS = ('templates', 'azimuth', 'builds')
# Kind and number of dimensions of entries.
_ENTRY_KINDS = {
    'format': ('U', 0),
    'version': ('i', 0),
    'builds': ('U', 1),
    'fill': ('f', 0),
    'provenance': ('U', 0),
}
_FINER = 'finer_'


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
    :param finer: the same builds in more directions, in the grid of :func:`fine_grid`, by which
        phases are estimated; None if there are no such views.

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
    finer: TemplateBank | None = None

    def __post_init__(self) -> None:
        if self.templates.ndim != 4 or self.templates.dtype != np.uint8:
            raise BankError(
                'templates must be (sequences, phases, height, width) uint8, got '
                f'{self.templates.shape} {self.templates.dtype}'
            )
        if 0 in self.templates.shape:
            raise BankError(f'a bank must not be empty, got shape {self.templates.shape}')
        if math.prod(self.grid) > _MOST_PIXELS:
            raise BankError(
                f'templates must have at most {_MOST_PIXELS} pixels, got {math.prod(self.grid)}'
            )
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
        if self.finer is not None:
            needed = self.phases, fine_grid(self.grid), sorted(set(self.builds))
            found = self.finer.phases, self.finer.grid, sorted(set(self.finer.builds))
            if found != needed:
                raise BankError(
                    f'finer views must have phases, grid and builds {needed}, got {found}'
                )

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> TemplateBank:
        """
        Read a bank from a file made by :meth:`save`.

        :raises BankError: if the file is missing, damaged, no bank or a bank of another version.
        """
        arrays = _read_arrays(Path(path))
        try:
            return cls(**_entries(arrays))
        except BankError as error:
            raise BankError(f'{os.fspath(path)}: {error}') from error

    def save(self, path: str | os.PathLike[str]) -> None:
        """Replace a file in one step; BankError if it cannot be written."""
        packed = io.BytesIO()
        finer = {} if self.finer is None else self.finer._views()
        np.savez_compressed(
            packed,
            format=np.array(BANK_FORMAT),
            version=np.array(BANK_VERSION, dtype=np.int64),
            **self._views(),
            fill=np.array(self.fill, dtype=np.float64),
            provenance=np.array(json.dumps(self.provenance, sort_keys=True)),
            **{f'{_FINER}{name}': array for name, array in finer.items()},
        )
        try:
            write_file(Path(path), packed.getvalue())
        except OSError as error:
            reason = error.strerror or str(error)
            raise BankError(f'cannot write the bank {os.fspath(path)}: {reason}') from error

    def _views(self) -> dict[str, Any]:
        """Return the entries of a file that hold the templates."""
        builds = np.array(self.builds, dtype=np.str_)
        return {'templates': self.templates, 'azimuth': self.azimuth, 'builds': builds}

    @property
    def sequences(self) -> int:
        """Return V, the number of sequences."""
        return int(self.templates.shape[0])

    @cached_property
    def phases(self) -> int:
        """Return P, the number of phases."""
        return int(self.templates.shape[1])

    @property
    def grid(self) -> tuple[int, int]:
        """Return (H, W) of the template grid."""
        return int(self.templates.shape[2]), int(self.templates.shape[3])


def open_bank(path: str) -> TemplateBank:
    """Return the bank of a file, or for an empty path the standard one; BankError if none."""
    return TemplateBank.load(path) if path else default_bank()


@cache
def default_bank() -> TemplateBank:
    """
    Return the standard bank, an average walker from all sides: kept and shared, not to be changed.

    :raises BankError: if the installation is damaged.
    """
    return TemplateBank.load(Path(__file__).with_name('standard.npz'))


def fine_grid(grid: tuple[int, int]) -> tuple[int, int]:
    """Return rows and columns of finer views: 48 rows of the proportions of a grid."""
    height, width = grid
    return _FINE_ROWS, max(round(_FINE_ROWS * width / height), LEAST_SIDE)


def quantize(templates: NDArray[np.uint8], levels: int) -> NDArray[np.uint8]:
    """Round uint8 of any shape to 2..256 evenly spaced grey levels that include 0 and 255."""
    steps = np.arange(256, dtype=np.float64) * (levels - 1) / 255
    table = np.floor(np.floor(steps + 0.5) * 255 / (levels - 1) + 0.5).astype(np.uint8)
    # NumPy's own indexing takes ten times as long.
    return np.asarray(cv2.LUT(np.ascontiguousarray(templates).reshape(-1, 1), table)).reshape(
        templates.shape
    )


def _read_arrays(path: Path) -> dict[str, Any]:
    """Return all entries of a file."""
    try:
        # Opened here, because numpy leaves the file open if the archive is damaged.
        with Path(path).open('rb') as file:
            if not zipfile.is_zipfile(file):
                raise BankError(f'{path} is not a bank: expected an .npz archive')
            file.seek(0)
            archive = np.load(file, allow_pickle=False)
            if not isinstance(archive, np.lib.npyio.NpzFile):
                raise BankError(f'{path} is not a bank: expected an .npz archive')
            return {name: archive[name] for name in archive.files}
    except OSError as error:
        reason = error.strerror or str(error)
        raise BankError(f'cannot read the bank {path}: {reason}') from error
    except (
        ValueError,
        EOFError,
        KeyError,
        RuntimeError,  # also what zipfile raises for encrypted and unknown archives
        tokenize.TokenError,  # NumPy's, for a damaged header
        zipfile.BadZipFile,
        zlib.error,
    ) as error:
        raise BankError(f'{path} is not a bank or is damaged: {error}') from error


def _check_kinds(arrays: dict[str, Any], *names: str) -> None:
    for name in names:
        value = arrays[name]
        found = value.dtype.kind, value.ndim
        kind, dimensions = _ENTRY_KINDS.get(name.removeprefix(_FINER), found)
        if found != (kind, dimensions):
            what = 'texts' if dimensions else 'a single text' if kind == 'U' else 'a single number'
            raise BankError(
                f'entry {name!r} must be {what}, got {value.dtype} of shape {value.shape}'
            )


def _entries(arrays: dict[str, Any]) -> dict[str, Any]:
    """Return the fields of a bank; refuse what the file format does not promise."""
    if 'format' not in arrays or 'version' not in arrays:
        found = ', '.join(sorted(arrays)) or 'none'
        raise BankError(f'not a bank: entries format and version expected, got {found}')
    _check_kinds(arrays, 'format', 'version')
    if (name := arrays['format'].item()) != BANK_FORMAT:
        raise BankError(f'not a bank: format must be {BANK_FORMAT!r}, got {name!r}')
    if (version := arrays['version'].item()) != BANK_VERSION:
        raise BankError(
            f'a bank of version {version}, this program reads version {BANK_VERSION}: build it '
            'again with `gait_bank build`'
        )
    finer = any(entry.startswith(_FINER) for entry in arrays)
    needed = (*_VIEWS, 'fill', 'provenance', *(f'{_FINER}{name}' for name in _VIEWS if finer))
    if missing := [entry for entry in needed if entry not in arrays]:
        raise BankError(f'entries missing: {", ".join(missing)}')
    _check_kinds(arrays, *needed)
    try:
        provenance = json.loads(arrays['provenance'].item())
    except (ValueError, RecursionError) as error:
        raise BankError(f'provenance must be JSON: {error}') from error
    if not isinstance(provenance, dict) or not all(
        isinstance(value, str) for value in provenance.values()
    ):
        raise BankError('provenance must be a JSON object of texts')
    views, fine = (
        {name: arrays[prefix + name] for name in _VIEWS}
        for prefix in ('', _FINER if finer else '')
    )
    for each in (views, fine):
        each['builds'] = tuple(each['builds'].tolist())
        each['fill'] = arrays['fill'].item()
    return {**views, 'provenance': provenance, 'finer': TemplateBank(**fine) if finer else None}

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Bank files: compressed ``.npz`` archives of plain arrays, read without pickle.

Entries: ``format`` (the text :data:`FORMAT`), ``version`` (:data:`FORMAT_VERSION`),
``templates``, ``azimuth``, ``builds``, ``fill`` and ``provenance`` (a JSON object of texts).
"""

from __future__ import annotations

import io
import json
import os
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from gait_segmentation.errors import BankError
from gait_segmentation.files.output_files import write_file
from gait_segmentation.files.reading import regular

__all__ = ['FORMAT', 'FORMAT_VERSION', 'read_bank', 'write_bank']

FORMAT = 'gait_segmentation template bank'
FORMAT_VERSION = 1
_ENTRIES = ('templates', 'azimuth', 'builds', 'fill', 'provenance')


def write_bank(path: str | os.PathLike[str], entries: dict[str, Any]) -> None:
    """
    Write the entries of a bank, replacing the file in one step.

    :param path: the file; its folder must exist.
    :param entries: templates, azimuth, builds, fill and provenance as in ``TemplateBank``.
    :raises BankError: if the file cannot be written.
    """
    path = Path(path)
    arrays = {
        'format': np.array(FORMAT),
        'version': np.array(FORMAT_VERSION, dtype=np.int64),
        'templates': entries['templates'],
        'azimuth': entries['azimuth'],
        'builds': np.array(entries['builds'], dtype=np.str_),
        'fill': np.array(entries['fill'], dtype=np.float64),
        'provenance': np.array(json.dumps(entries['provenance'], sort_keys=True)),
    }
    packed = io.BytesIO()
    np.savez_compressed(packed, **arrays)
    try:
        write_file(path, packed.getvalue())
    except OSError as error:
        reason = error.strerror or str(error)
        raise BankError(f'cannot write the bank {path}: {reason}') from error


def _scalar(value: Any, kind: str, name: str, path: Path) -> Any:
    if value.shape != () or value.dtype.kind != kind:
        raise BankError(
            f'{path}: entry {name!r} must be a single {"text" if kind == "U" else "number"}, '
            f'got {value.dtype} of shape {value.shape}'
        )
    return value.item()


def _read_arrays(path: Path) -> dict[str, Any]:
    try:
        # Opened here, because numpy leaves the file open if the archive is damaged.
        with regular(path).open('rb') as file:
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
        zipfile.BadZipFile,
        zlib.error,
    ) as error:
        raise BankError(f'{path} is not a bank or is damaged: {error}') from error


def read_bank(path: str | os.PathLike[str]) -> dict[str, Any]:
    """
    Read the entries of a bank and check everything the file format promises.

    :param path: the file.
    :returns: templates, azimuth, builds, fill and provenance for ``TemplateBank``.
    :raises BankError: if the file is missing, damaged, no bank or a bank of another version.
    """
    path = Path(path)
    arrays = _read_arrays(path)
    if 'format' not in arrays or 'version' not in arrays:
        found = ', '.join(sorted(arrays)) or 'none'
        raise BankError(f'{path} is not a bank: entries format and version expected, got {found}')
    name = _scalar(arrays['format'], 'U', 'format', path)
    if name != FORMAT:
        raise BankError(f'{path} is not a bank: format must be {FORMAT!r}, got {name!r}')
    version = _scalar(arrays['version'], 'i', 'version', path)
    if version != FORMAT_VERSION:
        raise BankError(
            f'{path} is a bank of version {version}, this program reads version '
            f'{FORMAT_VERSION}: build it again with `gait_bank build`'
        )
    missing = [entry for entry in _ENTRIES if entry not in arrays]
    if missing:
        raise BankError(f'{path}: entries missing: {", ".join(missing)}')
    builds = arrays['builds']
    if builds.ndim != 1 or builds.dtype.kind != 'U':
        raise BankError(
            f'{path}: builds must be a list of texts, got {builds.dtype} of shape {builds.shape}'
        )
    text = _scalar(arrays['provenance'], 'U', 'provenance', path)
    try:
        provenance = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise BankError(f'{path}: provenance must be JSON: {error}') from error
    if not isinstance(provenance, dict) or not all(
        isinstance(value, str) for value in provenance.values()
    ):
        raise BankError(f'{path}: provenance must be a JSON object of texts')
    return {
        'templates': arrays['templates'],
        'azimuth': arrays['azimuth'],
        'builds': tuple(str(build) for build in builds),
        'fill': float(_scalar(arrays['fill'], 'f', 'fill', path)),
        'provenance': provenance,
    }

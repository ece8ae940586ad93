# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Making banks from the gait model, and keeping them in the user's cache folder.

The standard bank is drawn once; so are finer views of its walkers, by which phases are compared.
"""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import json
import math
import os
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.config import StageConfig, parameter
from gait_segmentation.errors import BankError
from gait_segmentation.gait_model.bank import FORMAT_VERSION, TemplateBank
from gait_segmentation.gait_model.body import named_build
from gait_segmentation.gait_model.render import render_cycle

__all__ = [
    'DIRECTIONS',
    'BankSpec',
    'build_bank',
    'cache_folder',
    'cached_bank',
    'default_bank',
    'fine_grid',
    'finer_bank',
    'open_bank',
    'quantize',
]

_MODEL_SOURCES = ('walker.json', 'skeleton.py', 'body.py', 'render.py', 'builder.py')

DIRECTIONS = 64
"""From the front, views must lie this close for the phases to be told apart."""
_FINE_ROWS = 48
"""Outlines move by less than a row between phases, but all along their length."""
_LEAST_SIDE = 16
"""Rows and columns of the smallest grid."""


@dataclass(frozen=True)
class BankSpec(StageConfig):
    """
    What a bank of the gait model holds: builds x azimuths sequences of ``phases`` templates.

    :raises ConfigError: if a value is outside what its field allows.
    """

    height: int = parameter(96, 'Rows of a template.', unit='px', minimum=_LEAST_SIDE, maximum=512)
    width: int = parameter(
        64, 'Columns of a template.', unit='px', minimum=_LEAST_SIDE, maximum=512
    )
    azimuths: int = parameter(
        16,
        'Directions of walking, evenly round the full turn from 0; 2 = both side views.',
        minimum=1,
        maximum=72,
    )
    phases: int = parameter(30, 'Templates a stride.', minimum=4, maximum=240)
    builds: str = parameter('average', 'Names of builds, separated by commas.')
    elevation: float = parameter(
        0.0, 'How far the camera looks down.', unit='rad', minimum=-1.0, maximum=1.0
    )
    levels: int = parameter(
        8,
        'Grey levels of a template; fewer make the matching cheaper.',
        minimum=2,
        maximum=256,
    )
    fill: float = parameter(0.9, 'Share of the rows the body takes.', minimum=0.5, maximum=1.0)

    @property
    def build_names(self) -> tuple[str, ...]:
        """Return the names of the builds."""
        return tuple(name.strip() for name in self.builds.split(','))

    @property
    def azimuth_values(self) -> tuple[float, ...]:
        """Return the azimuths in (-pi, pi], starting at 0 and turning to the left."""
        turns = (k / self.azimuths for k in range(self.azimuths))
        return tuple(2 * math.pi * (t if t <= 0.5 else t - 1) for t in turns)


def model_digest() -> str:
    """Return a hash of the gait model itself, by which banks say what drew them."""
    digest = hashlib.sha256()
    for name in _MODEL_SOURCES:
        digest.update((Path(__file__).parent / name).read_bytes())
    return digest.hexdigest()[:16]


def quantize(templates: NDArray[np.uint8], levels: int) -> NDArray[np.uint8]:
    """
    Round to evenly spaced grey levels that include 0 and 255.

    :param templates: uint8 of any shape.
    :param levels: number of levels, 2..256.
    """
    steps = np.arange(256, dtype=np.float64) * (levels - 1) / 255
    table = np.floor(np.floor(steps + 0.5) * 255 / (levels - 1) + 0.5).astype(np.uint8)
    # NumPy's own indexing takes ten times as long.
    return np.asarray(cv2.LUT(np.ascontiguousarray(templates).reshape(-1, 1), table)).reshape(
        templates.shape
    )


def build_bank(
    spec: BankSpec | None = None, progress: Callable[[], None] | None = None
) -> TemplateBank:
    """
    Draw a bank.

    :param spec: what it holds; the defaults if None.
    :param progress: called after each sequence.
    :returns: a bank whose sequences are ordered by build, then azimuth.
    :raises BankError: if a build is unknown.
    """
    spec = BankSpec() if spec is None else spec
    names, azimuths = spec.build_names, spec.azimuth_values
    for name in names:
        named_build(name)
    phases = np.arange(spec.phases) / spec.phases
    templates = np.empty(
        (len(names) * len(azimuths), spec.phases, spec.height, spec.width), dtype=np.uint8
    )
    for index in range(len(templates)):
        cycle = render_cycle(
            phases,
            azimuths[index % len(azimuths)],
            build=names[index // len(azimuths)],
            elevation=spec.elevation,
            grid=(spec.height, spec.width),
            fill=spec.fill,
        )
        templates[index] = quantize(cycle, spec.levels)
        if progress is not None:
            progress()
    return TemplateBank(
        templates,
        np.array(azimuths * len(names), dtype=np.float32),
        tuple(name for name in names for _ in azimuths),
        spec.fill,
        {
            'source': 'gait model',
            'model': model_digest(),
            'spec': json.dumps(asdict(spec), sort_keys=True),
        },
    )


def cache_folder() -> Path:
    """Return ``$XDG_CACHE_HOME/gait_segmentation``, by default below ``~/.cache``."""
    base = os.environ.get('XDG_CACHE_HOME', '')
    # The XDG specification: a relative path is to be ignored.
    root = Path(base) if os.path.isabs(base) else Path(os.path.expanduser('~/.cache'))
    return root / 'gait_segmentation'


def _key(spec: BankSpec) -> str:
    what = json.dumps([FORMAT_VERSION, model_digest(), asdict(spec)], sort_keys=True)
    return hashlib.sha256(what.encode()).hexdigest()[:20]


def cached_bank(spec: BankSpec, progress: Callable[[], None] | None = None) -> TemplateBank:
    """
    Return the bank of a specification from the cache, drawing it if it is not there.

    A cache that cannot be read or written, or holds a damaged file, only costs the drawing.  The
    last banks read are kept and shared: nobody may write to them.

    :param progress: called after each sequence that is drawn.
    :raises BankError: if a build is unknown.
    """
    path = cache_folder() / f'bank-{_key(spec)}.npz'
    with contextlib.suppress(BankError, OSError):
        found = path.stat()
        return _loaded(path, found.st_mtime_ns, found.st_size)
    bank = build_bank(spec, progress)
    with contextlib.suppress(BankError, OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        bank.save(path)
    return bank


@lru_cache(maxsize=2)
def _loaded(path: Path, changed_ns: int, size: int) -> TemplateBank:
    """Return the bank of a file as it is since a time."""
    return TemplateBank.load(path)


def open_bank(path: str) -> TemplateBank:
    """
    Return the bank of a file, the standard one for an empty path.

    :raises BankError: if it cannot be read.
    """
    return TemplateBank.load(path) if path else default_bank()


def default_bank() -> TemplateBank:
    """Return the standard bank: an average walker from all sides."""
    return cached_bank(BankSpec())


def fine_grid(bank: TemplateBank) -> tuple[int, int]:
    """Return the rows and columns of finer views of a bank: 48 rows of the same proportions."""
    height, width = bank.grid
    return _FINE_ROWS, max(round(_FINE_ROWS * width / height), _LEAST_SIDE)


def finer_bank(
    bank: TemplateBank, progress: Callable[[], None] | None = None
) -> TemplateBank | None:
    """
    Return a bank of the same builds, phases and share of the rows in 64 directions.

    It is kept in the cache as others are.

    :param progress: called after each sequence that is drawn.
    :returns: None if the bank is not of this version of the gait model.
    """
    if bank.provenance.get('model') != model_digest():
        return None
    spec = BankSpec(**json.loads(bank.provenance['spec']))
    height, width = fine_grid(bank)
    return cached_bank(
        dataclasses.replace(spec, height=height, width=width, azimuths=DIRECTIONS, levels=256),
        progress,
    )

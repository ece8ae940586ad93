# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Making a bank from the gait model."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.config import StageConfig, parameter
from gait_segmentation.gait_model.bank import TemplateBank
from gait_segmentation.gait_model.build import named_build
from gait_segmentation.gait_model.render import render_cycle

__all__ = ['MODEL_VERSION', 'BankSpec', 'build_bank', 'model_digest', 'model_name', 'quantize']

MODEL_VERSION = 3
_MODEL_SOURCES = (
    'kinematics.py',
    'skeleton.py',
    'solid.py',
    'clothing.py',
    'body.py',
    'build.py',
    'projection.py',
    'raster.py',
    'render.py',
    'builder.py',
)


@dataclass(frozen=True)
class BankSpec(StageConfig):
    """
    What a bank of the gait model holds: builds x azimuths sequences of ``phases`` templates.

    :raises ConfigError: if a value is outside what its field allows.
    """

    height: int = parameter(96, 'Rows of a template.', unit='px', minimum=16, maximum=512)
    width: int = parameter(64, 'Columns of a template.', unit='px', minimum=16, maximum=512)
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
    """Return a hash of the gait model itself: its version and its source."""
    digest = hashlib.sha256(str(MODEL_VERSION).encode())
    for name in _MODEL_SOURCES:
        digest.update((Path(__file__).parent / name).read_bytes())
    return digest.hexdigest()[:16]


def model_name() -> str:
    """Return what a bank's provenance says of the model that drew it."""
    return f'version {MODEL_VERSION}, {model_digest()}'


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
            'model': model_name(),
            'spec': json.dumps(asdict(spec), sort_keys=True),
        },
    )

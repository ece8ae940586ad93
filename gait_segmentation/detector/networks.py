# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The networks that may look at images: those of the package, and ONNX files of users."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.config import StageConfig, parameter
from gait_segmentation.detector.detection import Detection
from gait_segmentation.detector.onnx_file import OnnxFile
from gait_segmentation.detector.person_detector import LEAST_SHARE, default_detector
from gait_segmentation.detector.person_masks import PersonMasks, default_masks
from gait_segmentation.errors import DetectorError
from gait_segmentation.geometry import Box

NONE, BOXES, PEOPLE = 'none', 'boxes', 'people'
SHIPPED = NONE, BOXES, PEOPLE
"""Networks that have a name, and are part of the package."""


@dataclass(frozen=True)
class DetectorConfig(StageConfig):
    """Which network looks at whole images, and how often."""

    network: str = parameter(
        PEOPLE,
        'people = the detector of this package, and a mask of each person by a second network; '
        'boxes = the detector alone; FILE.onnx = a network of your own, for boxes or a heat map; '
        'none = no network: boxes are given, or people are in a heat map.',
        fixed=True,
        names=SHIPPED,
    )
    person_class: int = parameter(
        -1,
        'Number of the class that counts in FILE.onnx; -1 = person by its own names, the first '
        'one if it has none.',
        minimum=-1,
        maximum=9999,
        fixed=True,
    )
    calm_period: float = parameter(
        0.4,
        'Time between two looks for boxes while all is well.',
        unit='s',
        minimum=0.0,
        maximum=60.0,
        fixed=True,
    )
    urgent_period: float = parameter(
        0.1,
        'The same while nobody is tracked, somebody is lost, was not seen or may begin, or people '
        'are near each other.',
        unit='s',
        minimum=0.0,
        maximum=60.0,
        fixed=True,
    )
    close_period: float = parameter(
        0.8,
        'Time between two closer looks, for small people, while there is room for somebody, or '
        'somebody small is followed.',
        unit='s',
        minimum=0.0,
        maximum=60.0,
        fixed=True,
    )
    mask_rate: float = parameter(
        15.0,
        'Masks that are drawn in a second, of all people together.',
        unit='1/s',
        minimum=0.0,
        maximum=1000.0,
        fixed=True,
    )


class Networks(NamedTuple):
    """
    What looks at images, (H, W, 3) uint8 BGR.

    ``people`` says who is in one, of people of a height above ``least_share`` of the longer side,
    and ``closely`` also of others; ``about`` says it of a box alone; ``masks`` draws each of them,
    and ``heat_map`` all at once, (h, w) uint8, P(person) of the whole image; any of them may not
    be there.
    """

    people: Callable[[NDArray[np.uint8]], Sequence[Detection]] | None
    masks: PersonMasks | None = None
    heat_map: Callable[[NDArray[np.uint8]], NDArray[np.uint8]] | None = None
    closely: Callable[[NDArray[np.uint8]], Sequence[Detection]] | None = None
    about: Callable[[NDArray[np.uint8], Box], Sequence[Detection]] | None = None
    least_share: float = 0.0


def open_networks(name: str, person_class: int = -1) -> Networks:
    """
    Load the networks of a ``detector.network``.

    :param person_class: see :class:`DetectorConfig`.
    :raises DetectorError: if they cannot be used.
    """
    if name == NONE:
        return Networks(None)
    if name in (BOXES, PEOPLE):
        return _shipped()._replace(masks=default_masks() if name == PEOPLE else None)
    path = Path(name)
    if path.suffix != '.onnx':
        raise DetectorError(
            f'detector.network must be {PEOPLE}, {BOXES}, {NONE} or a file FILE.onnx, got {name!r}'
        )
    network = OnnxFile(path, person_class)
    if network.kind == 'map':
        return _shipped()._replace(heat_map=network.draw)
    return Networks(network.people)


def _shipped() -> Networks:
    """Return the package's detector."""
    detector = default_detector()
    return Networks(
        detector.people, closely=detector.closely, about=detector.about, least_share=LEAST_SHARE
    )

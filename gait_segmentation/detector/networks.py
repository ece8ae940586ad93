# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The networks that may look at images: those of the package, and ONNX files of users."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.config import StageConfig, parameter
from gait_segmentation.detector.detection import Detection
from gait_segmentation.detector.person_detector import (
    LEAST_SCORE,
    default_detector,
    detections_of,
    resized,
)
from gait_segmentation.detector.person_masks import PersonMasks
from gait_segmentation.errors import DetectorError, one_line
from gait_segmentation.images import check_image

BOXES, PEOPLE = 'boxes', 'people'
"""Networks that have a name."""

_DYNAMIC = 640
"""Side of the image that a network sees which takes any, in pixels."""

_STRIDES = (8, 16, 32)
"""Of the cells that YOLO has a box for each of, in pixels."""

_ROUNDED = 1e-3
_PADDING = (114, 114, 114)

_INPUT = re.compile(
    r'inputs: \[\s*"[^"]*" // <Input> \S+ \[1 x 3 x (\w+) x (\w+|sym\(\d+\))\]\s*\]'
)
"""How OpenCV tells of a network's only input."""

_SHAPES = (
    'a heat map (h x w or 1 x h x w, 0..1), or boxes as YOLOX has them (n x 5 + classes), YOLOv8 '
    'or later (4 + classes x n), or with the suppression in it (n x 6)'
)


@dataclass(frozen=True)
class DetectorConfig(StageConfig):
    """Which network looks at whole images, and how often."""

    network: str = parameter(
        BOXES,
        'boxes = the detector of this package, where starting.auto_init asks for it; people = it '
        'and a mask of each person, by a second network that gait_warm_up --people fetches once; '
        'FILE.onnx = a network of your own, for boxes or a heat map.',
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
        'The same while nobody is tracked, or somebody is lost or was not seen.',
        unit='s',
        minimum=0.0,
        maximum=60.0,
        fixed=True,
    )


class Networks(NamedTuple):
    """
    What looks at images, (H, W, 3) uint8 BGR.

    ``people`` says who is in one, ``masks`` draws each of them, and ``heat_map`` all at once,
    (h, w) uint8, P(person) of the whole image; either of the latter may not be there.
    """

    people: Callable[[NDArray[np.uint8]], Sequence[Detection]]
    masks: PersonMasks | None = None
    heat_map: Callable[[NDArray[np.uint8]], NDArray[np.uint8]] | None = None


def open_networks(name: str) -> Networks:
    """Load the networks of a ``detector.network``; DetectorError if they cannot be used."""
    if name == BOXES:
        return Networks(default_detector().people)
    if name == PEOPLE:
        return Networks(default_detector().people, PersonMasks())
    path = Path(name)
    if path.suffix != '.onnx':
        raise DetectorError(
            f'detector.network must be {BOXES}, {PEOPLE} or a file FILE.onnx, got {name!r}'
        )
    network = _File(path)
    if network.kind == 'map':
        return Networks(default_detector().people, heat_map=network.draw)
    return Networks(network.people)


def read_network(
    path: Path,
) -> tuple[cv2.dnn.Net, tuple[int, int], Sequence[NDArray[np.float32]]]:
    """
    Read an ONNX file of a user's.

    :returns: the network, height and width of its input, and all that it gives for a black image.
    :raises DetectorError: if it cannot be used, or its input is not 1 x 3 x height x width.
    """
    try:
        net = cv2.dnn.readNetFromONNX(np.frombuffer(path.read_bytes(), np.uint8))
        shape = _INPUT.search(net.dump())
        if shape is None:
            raise DetectorError(
                f'{path} must have one input, 1 x 3 x height x width (OpenCV '
                f'{cv2.__version__} has read it; before 5.0 it does not tell)'
            )
        height, width = (int(each) if each.isdigit() else _DYNAMIC for each in shape.groups())
        net.setInput(np.zeros((1, 3, height, width), np.float32))
        outputs = net.forward(net.getUnconnectedOutLayersNames())
    except (OSError, cv2.error) as error:
        why = error.strerror if isinstance(error, OSError) else error
        raise DetectorError(f'{path} cannot be loaded: {one_line(why)}') from error
    return net, (height, width), outputs


class _File:
    """A network of a user's, of a kind that the shape of its output tells."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._net, (self._height, self._width), outputs = read_network(path)
        self.kind = self._kind(outputs[0].shape)

    def _forward(self, blob: NDArray[np.float32]) -> NDArray[np.float32]:
        self._net.setInput(blob)
        return np.asarray(self._net.forward(self._net.getUnconnectedOutLayersNames()[0]))

    def _kind(self, shape: tuple[int, ...]) -> str:
        cells = sum((self._height // each) * (self._width // each) for each in _STRIDES)
        rows, columns = shape[1:] if len(shape) == 3 and shape[0] == 1 else (0, 0)
        if columns == 6 and rows != cells:
            return 'boxes'
        if rows == cells and columns > 5:
            return 'yolox'
        if columns == cells and rows > 4:
            return 'yolo'
        # Of a batch, and of one channel before or behind the pixels.
        sides = [each for each in shape if each != 1]
        if len(sides) == 2 and abs(sides[0] * self._width - sides[1] * self._height) < max(
            self._width, self._height
        ):
            return 'map'
        found = ' x '.join(map(str, shape))
        raise DetectorError(f'the first output of {self._path} must be {_SHAPES}, got {found}')

    def _seen(self, image: NDArray[np.uint8], scale: float, *, rgb: bool) -> NDArray[np.float32]:
        """Return what the network says of an image, which fills its input from the top left."""
        check_image(image)
        small = resized(image, scale)
        below, right = self._height - small.shape[0], self._width - small.shape[1]
        small = cv2.copyMakeBorder(small, 0, below, 0, right, cv2.BORDER_CONSTANT, value=_PADDING)
        blob = cv2.dnn.blobFromImage(small, 1 / 255 if rgb else 1.0, swapRB=rgb)
        try:
            return self._forward(blob)
        except cv2.error as error:
            raise DetectorError(f'{self._path}: {one_line(error)}') from error

    def _scale(self, image: NDArray[np.uint8]) -> float:
        return min(self._width / image.shape[1], self._height / image.shape[0])

    def people(self, image: NDArray[np.uint8]) -> list[Detection]:
        """Return who is seen in an image, (H, W, 3) uint8 BGR; see :class:`Networks`."""
        scale = self._scale(image)
        found = self._seen(image, scale, rgb=self.kind != 'yolox')[0]
        if self.kind == 'boxes':
            found = found[found[:, 5] == 0]
            boxes, scores = found[:, :4], found[:, 4]
            boxes = np.hstack([boxes[:, :2], boxes[:, 2:] - boxes[:, :2]])
        else:
            if self.kind == 'yolo':
                found = found.T
                scores = found[:, 4]
            else:
                found = self._decoded(found)
                scores = found[:, 4] * found[:, 5]
            boxes = np.hstack([found[:, :2] - found[:, 2:4] / 2, found[:, 2:4]])
        likely = (scores >= LEAST_SCORE) & np.isfinite(boxes).all(axis=1)
        return detections_of(boxes[likely] / scale, scores[likely], image.shape)

    def _decoded(self, cells: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the cells of YOLOX with centres and sizes in pixels of the network's image."""
        grid = [
            (column, row, stride)
            for stride in _STRIDES
            for row in range(self._height // stride)
            for column in range(self._width // stride)
        ]
        corner, stride = np.hsplit(np.array(grid, np.float32), [2])
        sizes = np.exp(np.minimum(cells[:, 2:4], 20.0)) * stride
        return np.hstack([(cells[:, :2] + corner) * stride, sizes, cells[:, 4:]])

    def draw(self, image: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return P(person) in every pixel of an image, see :class:`Networks`."""
        scale = self._scale(image)
        found = self._seen(image, scale, rgb=True)
        found = found.reshape([each for each in found.shape if each != 1])
        least, most = float(found.min()), float(found.max())
        if not (least >= -_ROUNDED and most <= 1 + _ROUNDED):
            raise DetectorError(
                f'the heat map of {self._path} must be from 0 to 1, got {least:g} to {most:g}'
            )
        rows, columns = (
            max(1, round(side * scale * of / whole))
            for side, of, whole in zip(
                image.shape[:2], found.shape, (self._height, self._width), strict=True
            )
        )
        return np.rint(255 * np.clip(found[:rows, :columns], 0, 1)).astype(np.uint8)

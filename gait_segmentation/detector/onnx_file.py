# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A network of a user's: an ONNX file that finds people or makes a heat map, by ONNX Runtime."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.detector.detection import Detection
from gait_segmentation.detector.engine import onnx_runtime, open_session
from gait_segmentation.detector.person_detector import LEAST_SCORE, detections_of, resized
from gait_segmentation.errors import DetectorError, not_installed, one_line
from gait_segmentation.images import check_image

_DYNAMIC = 640
"""Side of the image that a network sees which takes any, in pixels."""

_STRIDES = (8, 16, 32)
"""Of the cells that YOLO has a box for each of, in pixels."""

_ROUNDED = 1e-3
_PADDING = (114, 114, 114)

_TYPES = {'tensor(float)': np.float32, 'tensor(float16)': np.float16}

_OTHERS = {
    b'version https://git-lfs': 'it is a pointer of Git LFS: git lfs pull brings the file',
    b'PK\x03\x04': 'it is a file of PyTorch: export the network to ONNX',
}
"""What files that are none begin with."""

_PERSON = ('person', 'pedestrian')
"""Names of the class that counts, in the order of preference."""

_SHAPES = (
    'a heat map (h x w or 1 x h x w, 0..1), or boxes as YOLOX has them (n x 5 + classes), YOLOv8 '
    'or later (4 + classes x n), or with the suppression in it (n x 6)'
)


class OnnxFile:
    """A network of a user's, of a kind that the shape of its output tells."""

    def __init__(self, path: Path, person_class: int = -1) -> None:
        """
        Load the network, and try it.

        :param person_class: number of the class that counts; -1 = person by its own names, the
            first one if it has none.
        :raises DetectorError: if it cannot be used.
        """
        self._path = path
        self._session = _opened(path)
        (self.height, self.width), self._type = _input_of(path, self._session)
        self._input = self._session.get_inputs()[0].name
        tried = self.run(np.zeros((1, 3, self.height, self.width), np.float32))
        self.kind = self._kind(tried.shape)
        # In cells offsets are small; in pixels they go over the whole image.
        self._in_pixels = self.kind == 'yolox' and tried[0, :, :2].max() > self.width / 4
        self._class = self._class_of(person_class)
        columns = {'yolox': tried.shape[-1] - 5, 'yolo': tried.shape[1] - 4}.get(self.kind)
        if columns is not None and self._class >= columns:
            raise DetectorError(
                f'detector.person_class must be below the {columns} classes of {path}, got '
                f'{self._class}'
            )

    def run(self, blob: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the first output for a blob of one image; DetectorError if there is none."""
        try:
            found = self._session.run(None, {self._input: blob.astype(self._type, copy=False)})
        except Exception as error:
            raise DetectorError(f'{self._path}: {one_line(error)}') from error
        return np.asarray(found[0], np.float32)

    def _class_of(self, asked: int) -> int:
        """Return the number of the class that counts."""
        if asked >= 0 or self.kind == 'map':
            return max(asked, 0)
        text = self._session.get_modelmeta().custom_metadata_map.get('names', '')
        try:
            names = ast.literal_eval(text)
            numbers = names if isinstance(names, dict) else dict(enumerate(names))
            named = {str(name).lower(): int(number) for number, name in numbers.items()}
        except (SyntaxError, TypeError, ValueError):
            return 0
        for name in _PERSON:
            if name in named:
                return named[name]
        known = ', '.join(list(named)[:8])
        raise DetectorError(
            f'{self._path} knows {known}, and no person: set detector.person_class to the number '
            'of the class that counts'
        )

    def _kind(self, shape: tuple[int, ...]) -> str:
        cells = sum((self.height // each) * (self.width // each) for each in _STRIDES)
        rows, columns = shape[1:] if len(shape) == 3 and shape[0] == 1 else (0, 0)
        if columns == 6 and rows != cells:
            return 'boxes'
        if rows == cells and columns > 5:
            return 'yolox'
        if columns == cells and rows > 4:
            return 'yolo'
        # Of a batch, and of one channel before or behind the pixels.
        sides = [each for each in shape if each != 1]
        if len(sides) == 2 and abs(sides[0] * self.width - sides[1] * self.height) < max(
            self.width, self.height
        ):
            return 'map'
        found = ' x '.join(map(str, shape))
        raise DetectorError(f'the first output of {self._path} must be {_SHAPES}, got {found}')

    def _seen(self, image: NDArray[np.uint8], scale: float, *, rgb: bool) -> NDArray[np.float32]:
        """Return what the network says of an image, which fills its input from the top left."""
        small = resized(image, scale)
        below, right = self.height - small.shape[0], self.width - small.shape[1]
        small = cv2.copyMakeBorder(small, 0, below, 0, right, cv2.BORDER_CONSTANT, value=_PADDING)
        return self.run(cv2.dnn.blobFromImage(small, 1 / 255 if rgb else 1.0, swapRB=rgb))

    def _scale(self, image: NDArray[np.uint8]) -> float:
        check_image(image)
        return min(self.width / image.shape[1], self.height / image.shape[0])

    def people(self, image: NDArray[np.uint8]) -> list[Detection]:
        """Return who is seen in an image, (H, W, 3) uint8 BGR."""
        scale = self._scale(image)
        found = self._seen(image, scale, rgb=self.kind != 'yolox')[0]
        if self.kind == 'boxes':
            found = found[found[:, 5] == self._class]
            boxes, scores = found[:, :4], found[:, 4]
            boxes = np.hstack([boxes[:, :2], boxes[:, 2:] - boxes[:, :2]])
        else:
            if self.kind == 'yolo':
                found = found.T
                scores = found[:, 4 + self._class]
            else:
                found = found if self._in_pixels else self._decoded(found)
                scores = found[:, 4] * found[:, 5 + self._class]
            boxes = np.hstack([found[:, :2] - found[:, 2:4] / 2, found[:, 2:4]])
        likely = (scores >= LEAST_SCORE) & np.isfinite(boxes).all(axis=1)
        return detections_of(boxes[likely] / scale, scores[likely], image.shape)

    def _decoded(self, cells: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the cells of YOLOX with centres and sizes in pixels of the network's image."""
        grid = [
            (column, row, stride)
            for stride in _STRIDES
            for row in range(self.height // stride)
            for column in range(self.width // stride)
        ]
        corner, stride = np.hsplit(np.array(grid, np.float32), [2])
        sizes = np.exp(np.minimum(cells[:, 2:4], 20.0)) * stride
        return np.hstack([(cells[:, :2] + corner) * stride, sizes, cells[:, 4:]])

    def draw(self, image: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return P(person) in every pixel of an image, (h, w) uint8, of the same proportions."""
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
                image.shape[:2], found.shape, (self.height, self.width), strict=True
            )
        )
        return np.rint(255 * np.clip(found[:rows, :columns], 0, 1)).astype(np.uint8)


def _opened(path: Path) -> Any:
    """Return a session for a file; what lies beside it, as its weights may, is found, too."""
    runtime = onnx_runtime()
    if runtime is None:
        raise DetectorError(f'{path} needs ONNX Runtime: {not_installed("onnxruntime")}')
    try:
        with path.open('rb') as file:
            start = file.read(64)
        return open_session(runtime, str(path))
    except OSError as error:
        raise DetectorError(f'{path} cannot be loaded: {error.strerror}') from error
    except Exception as error:
        known = (text for first, text in _OTHERS.items() if start.startswith(first))
        why = next(known, one_line(error)) if start else 'it is empty'
        raise DetectorError(f'{path} cannot be loaded: {why}') from error


def _input_of(path: Path, session: Any) -> tuple[tuple[int, int], type[np.floating[Any]]]:
    """Return height, width and type of the images that a network takes."""
    told = [
        (each.type, [side if isinstance(side, int) else None for side in each.shape])
        for each in session.get_inputs()
    ]
    kind, shape = told[0]
    fits = len(told) == 1 and len(shape) == 4 and kind in _TYPES
    if not (fits and shape[0] in (1, None) and shape[1] in (3, None)):
        texts = (f'{" x ".join(str(s or "?") for s in sides)} {kind}' for kind, sides in told)
        raise DetectorError(
            f'{path} must have one input, 1 x 3 x height x width of float, got '
            f'{" and ".join(texts)}: export it for a batch of 1, colours first'
        )
    return (shape[2] or _DYNAMIC, shape[3] or _DYNAMIC), _TYPES[kind]

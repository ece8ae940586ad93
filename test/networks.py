# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Small ONNX networks, and a picture for large ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper
from PIL import Image

from gait_segmentation.geometry import Box

WOMAN = Box(491, 27, 45, 164)
"""Who is in :func:`demo_picture`."""


def demo_picture() -> np.ndarray:
    """Return a woman who walks past a building, (212, 560, 3) uint8 BGR."""
    # Older OpenCV reads no animations; below is her silhouette.
    path = Path(__file__).parents[1] / 'docs/images/demo.webp'
    return np.ascontiguousarray(np.asarray(Image.open(path).convert('RGB'))[:212, :, ::-1])


def save(path: Path, shape, nodes, outputs: dict, names=None, **constants) -> Path:
    """Write a network with the input x of a shape, and names of its classes; return its path."""
    half = any(np.asarray(each).dtype == np.float16 for each in constants.values())
    real, about = TensorProto.FLOAT16 if half else TensorProto.FLOAT, helper.make_tensor_value_info
    graph = helper.make_graph(
        [helper.make_node(kind, inputs, out, **more) for kind, inputs, out, more in nodes],
        'network',
        [about('x', real, shape)],
        [about(name, real, sides) for name, sides in outputs.items()],
        [numpy_helper.from_array(np.asarray(each), name) for name, each in constants.items()],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid('', 13)], ir_version=8)
    if names is not None:
        helper.set_model_props(model, {'names': names})
    onnx.save(model, str(path))
    return path


def red_network(folder: Path, shape, factor: float = 1.0, sides=None) -> Path:
    """Write a network for images of a shape whose map is how red a pixel is."""
    pick = ('Gather', ['x', 'first'], ['red'], {'axis': 1})
    scale = ('Mul', ['red', 'factor'], ['map'], {})
    return save(
        folder / 'red.onnx',
        [1, 3, *(sides or shape[:2])],
        [pick, scale],
        {'map': [1, 1, *(sides or shape[:2])]},
        first=np.array([0]),
        factor=np.float32(factor),
    )


def box_network(
    folder: Path, output, shape=(1, 3, 64, 96), more=(), names=None, dtype='float32'
) -> Path:
    """Write a network that gives the same whatever it sees, and other outputs besides."""
    sum_ = ('ReduceMean', ['x'], ['mean'], {'axes': [1, 2, 3], 'keepdims': 0})
    none = ('Mul', ['mean', 'zero'], ['none'], {})
    nodes = [sum_, none, ('Add', ['none', 'given'], ['boxes'], {})]
    nodes += [('Add', ['none', 'zero'], [name], {}) for name in more]
    given = np.asarray(output, dtype)
    outputs = {'boxes': given.shape, **{name: [1] for name in more}}
    zero = np.zeros((), dtype)
    return save(folder / 'boxes.onnx', shape, nodes, outputs, names, given=given, zero=zero)

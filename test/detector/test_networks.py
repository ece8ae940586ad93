# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from gait_segmentation.detector.networks import open_networks
from gait_segmentation.detector.person_detector import default_detector
from gait_segmentation.errors import DetectorError
from gait_segmentation.geometry import Box
from test.networks import box_network, needs_opencv_5, red_network, save

pytestmark = needs_opencv_5

IMAGE = np.zeros((128, 128, 3), np.uint8)
BOX = Box(20, 10, 32, 96)
"""Of a person in the image, which is half as large in what the networks see, 96 x 64."""

CELLS = 12 * 8 + 6 * 4 + 3 * 2


def yolox():
    """Return what YOLOX says of the box: the cell at column 2 and row 5 of stride 8 has it."""
    found = np.zeros((1, CELLS, 7))
    cell = found[0, 5 * 12 + 2]
    cell[:4] = (18 / 8 - 2, 29 / 8 - 5, np.log(16 / 8), np.log(48 / 8))
    # Sure that something is there, and that it is a person; the last one is of another class.
    cell[4:] = (0.9, 0.9, 0.1)
    found[0, -1, 4:] = (0.9, 0.1, 0.9)
    return found


def yolo(classes=80):
    found = np.zeros((1, 4 + classes, CELLS))
    found[0, :5, 40] = (18, 29, 16, 48, 0.81)
    found[0, :4, 50] = (70, 29, 16, 48)
    found[0, 5, 50] = 0.9
    return found


def suppressed():
    rows = [[10, 5, 26, 53, 0.81, 0], [60, 5, 80, 50, 0.9, 2], [0, 0, 0, 0, 0, 0]]
    return np.array([rows])


@pytest.mark.parametrize('found', [yolox(), yolo(), yolo(2), suppressed()])
@pytest.mark.parametrize('more', [(), ('masks',)])
def test_boxes_are_those_of_people_in_the_image(tmp_path, found, more):
    networks = open_networks(str(box_network(tmp_path, found, more=more)))
    (person,) = networks.people(IMAGE)
    assert person.box.iou(BOX) > 0.99
    assert person.score == pytest.approx(0.81, abs=1e-4)
    assert networks.masks is networks.heat_map is None


@pytest.mark.parametrize('sides', [(64, 96), (96, 64), ('h', 'w')])
def test_a_map_lies_on_the_image_whatever_their_proportions(tmp_path, sides):
    image = np.zeros((60, 120, 3), np.uint8)
    image[20:40, 90:, 2] = 255
    image[:20, :, 0] = 255
    networks = open_networks(str(red_network(tmp_path, None, sides=sides)))
    found = networks.heat_map(image)
    assert found.shape[0] * 2 == found.shape[1]
    ys, xs = np.nonzero(found > 127)
    x, y = xs / found.shape[1], ys / found.shape[0]
    assert (x.min(), y.min(), y.max()) == pytest.approx((0.75, 1 / 3, 2 / 3), abs=0.05)
    assert len(xs) == pytest.approx(found.size / 12, rel=0.2)
    # Boxes are those of the package's own detector.
    assert networks.people == default_detector().people


def test_the_map_must_be_a_probability(tmp_path):
    heat_map = open_networks(str(red_network(tmp_path, (60, 80), factor=2.0))).heat_map
    heat_map(np.full((60, 80, 3), 100, np.uint8))
    with pytest.raises(DetectorError, match=r'red.onnx must be from 0 to 1, got 2 to 2'):
        heat_map(np.full((60, 80, 3), 255, np.uint8))


@pytest.mark.parametrize('shape', [(1, 5, 7, 9), (1, 7, 9), (1, 2, 64, 96), (10,)])
def test_a_network_of_another_kind_is_refused_with_what_is_taken(tmp_path, shape):
    path = box_network(tmp_path, np.zeros(shape))
    sides = ' x '.join(map(str, shape))
    with pytest.raises(DetectorError, match=rf'must be a heat map .*YOLOX.*, got {sides}$'):
        open_networks(str(path))


def test_a_file_that_is_no_network_is_refused_in_a_line(tmp_path):
    whole = box_network(tmp_path, yolox()).read_bytes()
    grey = save(
        tmp_path / 'grey.onnx', [1, 1, 64, 96], [('Relu', ['x'], ['y'], {})], {'y': [1, 1, 64, 96]}
    )
    (tmp_path / 'part.onnx').write_bytes(whole[: len(whole) // 2])
    (tmp_path / 'empty.onnx').write_bytes(b'')
    for name, why in (
        (grey, 'must have one input, 1 x 3 x height x width'),
        (tmp_path / 'part.onnx', 'part.onnx cannot be loaded: '),
        (tmp_path / 'empty.onnx', 'empty.onnx cannot be loaded: '),
        (tmp_path / 'none.onnx', 'none.onnx cannot be loaded: No such file'),
        (tmp_path / 'model.pt', "must be boxes, people or a file FILE.onnx, got '.*model.pt'"),
    ):
        with pytest.raises(DetectorError, match=why) as raised:
            open_networks(str(name))
        assert '\n' not in str(raised.value)

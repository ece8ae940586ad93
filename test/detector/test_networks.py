# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import onnx
import pytest

from gait_segmentation.detector.networks import open_networks
from gait_segmentation.detector.person_detector import default_detector
from gait_segmentation.errors import DetectorError, InputError
from gait_segmentation.geometry import Box
from test.networks import box_network, red_network, save

IMAGE = np.zeros((128, 128, 3), np.uint8)
BOX = Box(20, 10, 32, 96)
"""Of a person in the image, which is half as large in what the networks see, 96 x 64."""


def opened(path, **config):
    return open_networks(str(path), **config)


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


def decoded():
    """Return the same of a network that gives pixels: every cell has a box, if nobody in it."""
    found = yolox()
    columns = [8 * x for _ in range(8) for x in range(12)]
    found[0, :96, 0] = columns
    found[0, 5 * 12 + 2, :4] = (18, 29, 16, 48)
    return found


def suppressed():
    rows = [[10, 5, 26, 53, 0.81, 0], [60, 5, 80, 50, 0.9, 2], [0, 0, 0, 0, 0, 0]]
    return np.array([rows])


@pytest.mark.parametrize('found', [yolox(), decoded(), yolo(), yolo(2), suppressed()])
@pytest.mark.parametrize('more', [(), ('masks',)])
def test_boxes_are_those_of_people_in_the_image(tmp_path, found, more):
    networks = opened(box_network(tmp_path, found, more=more))
    (person,) = networks.people(IMAGE)
    assert person.box.iou(BOX) > 0.99
    assert person.score == pytest.approx(0.81, abs=1e-4)
    assert networks.masks is networks.heat_map is None


@pytest.mark.parametrize('sides', [(64, 96), (96, 64), ('h', 'w')])
def test_a_map_lies_on_the_image_whatever_their_proportions(tmp_path, sides):
    image = np.zeros((60, 120, 3), np.uint8)
    image[20:40, 90:, 2] = 255
    image[:20, :, 0] = 255
    networks = opened(red_network(tmp_path, None, sides=sides))
    found = networks.heat_map(image)
    assert found.shape[0] * 2 == found.shape[1]
    ys, xs = np.nonzero(found > 127)
    x, y = xs / found.shape[1], ys / found.shape[0]
    assert (x.min(), y.min(), y.max()) == pytest.approx((0.75, 1 / 3, 2 / 3), abs=0.05)
    assert len(xs) == pytest.approx(found.size / 12, rel=0.2)
    # Boxes are those of the package's own detector.
    assert networks.people == default_detector().people


@pytest.mark.parametrize('image', [IMAGE.astype(np.float32), IMAGE[..., 0], None])
def test_what_is_no_image_is_refused(tmp_path, image):
    maps = opened(red_network(tmp_path, None, sides=(64, 96)))
    boxes = opened(box_network(tmp_path, yolox()))
    for look in maps.heat_map, boxes.people:
        with pytest.raises(InputError, match='image must be a'):
            look(image)


def test_the_map_must_be_a_probability(tmp_path):
    heat_map = opened(red_network(tmp_path, (60, 80), factor=2.0)).heat_map
    heat_map(np.full((60, 80, 3), 100, np.uint8))
    with pytest.raises(DetectorError, match=r'red.onnx must be from 0 to 1, got 2 to 2'):
        heat_map(np.full((60, 80, 3), 255, np.uint8))


@pytest.mark.parametrize('shape', [(1, 5, 7, 9), (1, 7, 9), (1, 2, 64, 96), (10,)])
def test_a_network_of_another_kind_is_refused_with_what_is_taken(tmp_path, shape):
    path = box_network(tmp_path, np.zeros(shape))
    sides = ' x '.join(map(str, shape))
    with pytest.raises(DetectorError, match=rf'must be a heat map .*YOLOX.*, got {sides}$'):
        opened(path)


@pytest.mark.parametrize(
    ('names', 'asked', 'score'),
    [
        (None, -1, 0.81),
        (None, 1, 0.9),
        ("{0: 'car', 1: 'Person'}", -1, 0.9),
        ("['pedestrian', 'car']", -1, 0.81),
        ("{0: 'car', 1: 'person'}", 0, 0.81),
        ('no names', -1, 0.81),
    ],
)
def test_people_are_of_the_class_that_the_file_or_the_parameter_says(
    tmp_path, names, asked, score
):
    path = box_network(tmp_path, yolo(2), names=names)
    (person,) = opened(path, person_class=asked).people(IMAGE)
    assert person.score == pytest.approx(score, abs=1e-4)


def test_of_boxes_with_their_classes_those_count_that_are_asked_for(tmp_path):
    (other,) = opened(box_network(tmp_path, suppressed()), person_class=2).people(IMAGE)
    assert other.score == pytest.approx(0.9, abs=1e-4)


def test_a_network_without_people_asks_for_the_class_that_counts(tmp_path):
    path = box_network(tmp_path, yolo(2), names="{0: 'head', 1: 'helmet'}")
    with pytest.raises(DetectorError, match=r'knows head, helmet, and no person: set detector\.'):
        opened(path)
    with pytest.raises(DetectorError, match=r'person_class must be below the 2 classes .* got 2'):
        opened(path, person_class=2)


@pytest.mark.parametrize('kind', ['float16', 'beside', 'free'])
def test_a_network_is_read_however_it_is_exported(tmp_path, monkeypatch, kind):
    shape = ('n', 3, 'h', 'w') if kind == 'free' else (1, 3, 64, 96)
    found = suppressed()
    path = box_network(tmp_path, found, shape, dtype='float16' if kind == 'float16' else 'float32')
    if kind == 'beside':
        model = onnx.load(str(path))
        onnx.save_model(
            model, str(path), save_as_external_data=True, location='w.data', size_threshold=0
        )
        (tmp_path / 'elsewhere').mkdir()
        monkeypatch.chdir(tmp_path / 'elsewhere')
    (person,) = opened(path).people(IMAGE)
    scale = 5 if kind == 'free' else 0.5
    expected = BOX.scaled(0.5 / scale)
    assert person.box.iou(expected) > 0.98


@pytest.mark.parametrize(
    ('shape', 'told'),
    [
        ([1, 1, 64, 96], '1 x 1 x 64 x 96 tensor(float)'),
        ([1, 64, 96, 3], '1 x 64 x 96 x 3 tensor(float)'),
        ([4, 3, 64, 96], '4 x 3 x 64 x 96 tensor(float)'),
        ([1, 3], '1 x 3 tensor(float)'),
    ],
)
def test_another_input_is_refused_with_what_it_is(tmp_path, shape, told):
    path = save(tmp_path / 'net.onnx', shape, [('Relu', ['x'], ['y'], {})], {'y': shape})
    with pytest.raises(DetectorError) as raised:
        opened(path)
    assert f'got {told}: export it' in str(raised.value)


def test_a_file_that_is_no_network_is_refused_in_a_line(tmp_path, monkeypatch):
    whole = box_network(tmp_path, yolox()).read_bytes()
    for name, content, why in (
        ('part.onnx', whole[: len(whole) // 2], 'cannot be loaded: '),
        ('empty.onnx', b'', 'cannot be loaded: it is empty'),
        ('lfs.onnx', b'version https://git-lfs.github.com/spec/v1\noid', 'a pointer of Git LFS'),
        ('torch.onnx', b'PK\x03\x04data.pkl', 'a file of PyTorch: export'),
        ('none.onnx', None, 'cannot be loaded: No such file'),
        ('model.pt', None, 'must be people, boxes, none or a file FILE.onnx, got '),
    ):
        path = tmp_path / name
        if content is not None:
            path.write_bytes(content)
        with pytest.raises(DetectorError, match=why) as raised:
            opened(path)
        assert name in str(raised.value)
        assert '\n' not in str(raised.value)
    monkeypatch.setattr('gait_segmentation.detector.onnx_file.onnx_runtime', lambda: None)
    with pytest.raises(
        DetectorError,
        match=r'needs ONNX Runtime: the .* is not installed: pip install onnxruntime',
    ):
        opened(box_network(tmp_path, yolox()))

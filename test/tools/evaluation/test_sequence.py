# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later

import cv2
import numpy as np
import pytest
import yaml

from gait_segmentation.errors import SequenceError
from gait_segmentation.geometry import Box
from gait_tools.evaluation.sequence import Sequence

from .fakes import FakePipeline, run_sequence, write_sequence


@pytest.fixture
def folder(tmp_path):
    return write_sequence(tmp_path / 'walk', frames=3)


def rewrite(folder, **changes):
    path = folder / 'sequence.yaml'
    about = yaml.safe_load(path.read_text()) | changes
    path.write_text(yaml.safe_dump({k: v for k, v in about.items() if v is not None}))


def move(folder, before, after):
    (folder / before).rename(folder / after)


def test_a_sequence_is_loaded(folder):
    sequence = Sequence.load(folder)
    assert sequence.name == 'walk'
    assert sequence.size == (48, 40)
    assert sequence.fps == 25
    assert sequence.initial_box == Box(3, 5, 12, 31)
    assert sequence.numbers == [0, 1, 2]
    assert sequence.stamp_ns(0) > 0
    assert sequence.stamp_ns(2) - sequence.stamp_ns(0) == 80_000_000
    assert sequence.image(1).shape == (40, 48, 3)
    assert set(np.unique(sequence.truth(1))) == {0, 170, 255}


def test_a_name_may_precede_the_number(folder):
    before = Sequence.load(folder)
    truths = [before.truth(number) for number in before.numbers]
    for kind in ('frames', 'masks'):
        for path in list((folder / kind).iterdir()):
            path.rename(path.with_name(f'clip2_{kind}-{path.name}'))
    after = Sequence.load(folder)
    assert after.numbers == before.numbers
    for number, truth in zip(before.numbers, truths, strict=True):
        assert after.frames[number].name == f'clip2_frames-{before.frames[number].name}'
        np.testing.assert_array_equal(after.truth(number), truth)


def label(folder, boxes, frames=3):
    """Label people as filled boxes, {person: (x, y, width, height)}."""
    (folder / 'labels').mkdir(exist_ok=True)
    for number in range(frames):
        labels = np.zeros((40, 48), np.uint8)
        for person, (x, y, width, height) in boxes.items():
            labels[y : y + height, x : x + width] = person
        cv2.imwrite(str(folder / 'labels' / f'{number:04d}.png'), labels)


def test_labelled_people_start_from_their_true_boxes_or_from_those_given(folder):
    label(folder, {1: (4, 6, 10, 29), 2: (30, 8, 8, 20)})
    sequence = Sequence.load(folder)
    assert sequence.attendance.people == (1, 2)
    assert sequence.starts == {0: (sequence.initial_box, Box(30, 8, 8, 20))}
    rewrite(folder, initial_box=None)
    sequence = Sequence.load(folder)
    assert sequence.initial_box is None
    assert sequence.starts == {0: (Box(4, 6, 10, 29), Box(30, 8, 8, 20))}
    rewrite(folder, initial_boxes=[[3, 5, 12, 31], {'frame': 2, 'box': [29, 8, 9, 21]}])
    assert Sequence.load(folder).starts == {0: (Box(3, 5, 12, 31),), 2: (Box(29, 8, 9, 21),)}


@pytest.mark.parametrize(
    ('spoil', 'message'),
    [
        (lambda f: move(f, 'sequence.yaml', 'a'), r'is no sequence: there is no sequence\.yaml'),
        (lambda f: move(f, 'masks', 'a'), 'masks is missing'),
        (lambda f: [path.unlink() for path in (f / 'frames').iterdir()], 'has no images named'),
        (lambda f: (f / 'frames/2.png').write_bytes(b''), 'have the same number'),
        (lambda f: (f / 'frames/0001.png').unlink(), r'0001\.png is the mask of a frame that is'),
        (
            lambda f: [p.rename(p.with_suffix('.jpg')) for p in (f / 'masks').iterdir()],
            r'0000\.jpg must be a \.png',
        ),
        (lambda f: (f / 'sequence.yaml').write_text('- 1'), r'yaml must have names and values'),
        (lambda f: rewrite(f, fps=None), 'has no fps'),
        (lambda f: rewrite(f, fps=0), 'fps .* from 0.01 to 1000, got 0'),
        (lambda f: rewrite(f, initial_box=None), 'has no initial_box'),
        (lambda f: rewrite(f, initial_box=[1, 2, 3]), 'four numbers'),
        (lambda f: rewrite(f, initial_box=[1, 2, 0, 4]), 'positive width and height'),
        (lambda f: rewrite(f, initial_box=[100, 2, 5, 4]), 'not lie outside of .* 48 x 40'),
        (lambda f: rewrite(f, initial_frame=7), r'number of a frame \(0 to 2\), got 7'),
        (lambda f: rewrite(f, initial_boxes=[]), r'must be a list of boxes, got \[\]'),
        (
            lambda f: rewrite(f, initial_boxes=[{'frame': 9, 'box': [1, 2, 3, 4]}]),
            'a frame from 0 on, got 9',
        ),
    ],
)
def test_what_is_no_sequence_is_refused(folder, spoil, message):
    spoil(folder)
    with pytest.raises(SequenceError, match=message):
        Sequence.load(folder)


GREY = np.zeros((40, 48), np.uint8)
GREY[1:3] = 255
COLOURED = cv2.merge([GREY, GREY, 255 - GREY])


@pytest.mark.parametrize(
    ('kind', 'image', 'message'),
    [
        ('frames', None, r'0001\.png is not a complete image'),
        ('frames', COLOURED[:, :20], 'is 20x40, but must be 48x40 like the first frame'),
        ('masks', GREY[:20], 'is 48x20, but must be 48x40 like its frame'),
        ('masks', COLOURED, 'grey image of 8 bits'),
        ('masks', GREY.astype(np.uint16), 'grey image of 8 bits'),
    ],
)
def test_images_that_cannot_be_used_are_refused_when_read(folder, kind, image, message):
    sequence = Sequence.load(folder)
    path = getattr(sequence, kind)[1]
    path.write_bytes(b'' if image is None else cv2.imencode('.png', image)[1].tobytes())
    with pytest.raises(SequenceError, match=message):
        (sequence.image if kind == 'frames' else sequence.truth)(1)
    # Also a grey one that is written in colour.
    cv2.imwrite(str(sequence.masks[1]), cv2.merge([GREY] * 3))
    np.testing.assert_array_equal(sequence.truth(1), GREY)


@pytest.fixture
def walk(tmp_path):
    return Sequence.load(write_sequence(tmp_path / 'long'))


def write_maps(walk, name, numbers, shape):
    (walk.folder / name).mkdir()
    for number in numbers:
        path = walk.folder / name / f'{number:04d}.png'
        cv2.imwrite(str(path), np.full(shape, number, np.uint8))


@pytest.mark.parametrize(
    ('timing', 'own'),
    [
        ('', {n: n for n in range(8) if n != 5}),
        (':2', {n: n - 2 for n in range(2, 8) if n != 7}),
        (':1:3', {1: 0, 4: 3, 7: 6}),
    ],
)
def test_heat_maps_of_any_size_come_with_the_stamps_of_their_own_frames(walk, timing, own):
    with pytest.raises(SequenceError, match='map is missing'):
        walk.heat_maps('map')
    write_maps(walk, 'map', (), ())
    with pytest.raises(SequenceError, match=r'no heat map of a frame'):
        walk.heat_maps('map')
    (walk.folder / 'map').rmdir()
    write_maps(walk, 'map', set(walk.numbers) - {5}, (4, 7))
    pipeline = FakePipeline()
    run_sequence(pipeline, walk, heat_map=walk.heat_maps(f'map{timing}'))
    assert {came: int(values[0, 0]) for came, (values, _) in pipeline.heat_maps.items()} == own
    stamps = {came: stamp_ns for came, (_, stamp_ns) in pipeline.heat_maps.items()}
    assert stamps == {came: walk.stamp_ns(number) for came, number in own.items()}

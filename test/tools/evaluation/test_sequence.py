# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import cv2
import numpy as np
import pytest
import yaml

from gait_segmentation.errors import SequenceError
from gait_segmentation.geometry import Box
from gait_tools.evaluation.sequence import Sequence

from .fakes import write_sequence


@pytest.fixture
def folder(tmp_path):
    return write_sequence(tmp_path / 'walk', frames=3)


def rewrite(folder, **changes):
    path = folder / 'sequence.yaml'
    about = yaml.safe_load(path.read_text())
    about.update(changes)
    path.write_text(yaml.safe_dump({k: v for k, v in about.items() if v is not None}))


def test_a_sequence_is_loaded(folder):
    sequence = Sequence.load(folder)
    assert sequence.name == 'walk'
    assert sequence.size == (48, 40)
    assert sequence.fps == 25
    assert sequence.initial_box == Box(3, 5, 12, 31)
    assert sequence.numbers == [0, 1, 2]
    assert sequence.image(1).shape == (40, 48, 3)
    assert set(np.unique(sequence.truth(1))) == {0, 170, 255}


def test_stamps_follow_the_frame_rate_and_are_never_zero(folder):
    sequence = Sequence.load(folder)
    assert sequence.stamp_ns(0) > 0
    assert sequence.stamp_ns(2) - sequence.stamp_ns(0) == 80_000_000


def test_jpeg_frames_and_frames_without_mask(tmp_path):
    sequence = Sequence.load(write_sequence(tmp_path / 'a', suffix='jpg', without_mask=(1,)))
    assert sequence.image(0).shape == (40, 48, 3)
    assert sequence.truth(1) is None
    assert sequence.truth(2) is not None


def test_frames_before_the_first_box_are_left_out(folder):
    rewrite(folder, initial_frame=1)
    assert Sequence.load(folder).numbers == [1, 2]


def test_missing_parts_are_named(folder, tmp_path):
    with pytest.raises(SequenceError, match='nowhere is not a folder'):
        Sequence.load(tmp_path / 'nowhere')
    (folder / 'sequence.yaml').rename(folder / 'other.yaml')
    with pytest.raises(SequenceError, match=r'is no sequence: there is no sequence\.yaml'):
        Sequence.load(folder)
    (folder / 'other.yaml').rename(folder / 'sequence.yaml')
    (folder / 'masks').rename(folder / 'mask')
    with pytest.raises(SequenceError, match='masks is missing'):
        Sequence.load(folder)
    (folder / 'mask').rename(folder / 'masks')
    (folder / 'frames').rename(folder / 'frame')
    with pytest.raises(SequenceError, match='frames is missing'):
        Sequence.load(folder)
    (folder / 'frames').mkdir()
    with pytest.raises(SequenceError, match='no images'):
        Sequence.load(folder)


def test_masks_in_a_format_that_changes_values_are_refused(folder):
    for path in (folder / 'masks').iterdir():
        path.rename(path.with_suffix('.jpg'))
    with pytest.raises(SequenceError, match=r'0000\.jpg must be a \.png'):
        Sequence.load(folder)


def test_corrupt_images_are_refused_when_read(folder):
    sequence = Sequence.load(folder)
    sequence.frames[1].write_bytes(b'not an image')
    with pytest.raises(SequenceError, match=r'0001\.png is not a complete image'):
        sequence.image(1)
    sequence.frames[2].write_bytes(b'')
    with pytest.raises(SequenceError, match=r'0002\.png is not a complete image'):
        sequence.image(2)
    sequence.masks[1].unlink()
    with pytest.raises(SequenceError, match='cannot be read'):
        sequence.truth(1)


def test_images_of_another_size_are_refused(folder):
    sequence = Sequence.load(folder)
    cv2.imwrite(str(sequence.frames[1]), np.zeros((40, 20, 3), np.uint8))
    with pytest.raises(SequenceError, match='is 20x40, but must be 48x40'):
        sequence.image(1)
    cv2.imwrite(str(sequence.masks[1]), np.zeros((20, 48), np.uint8))
    with pytest.raises(SequenceError, match='is 48x20, but must be 48x40'):
        sequence.truth(1)


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


def test_odd_file_names_are_refused(folder):
    (folder / 'frames' / '0001.png').rename(folder / 'frames' / 'one.png')
    with pytest.raises(SequenceError, match='named by its number'):
        Sequence.load(folder)
    (folder / 'frames' / 'one.png').rename(folder / 'frames' / '2.png')
    with pytest.raises(SequenceError, match='same number'):
        Sequence.load(folder)
    (folder / 'frames' / '2.png').unlink()
    with pytest.raises(SequenceError, match='mask of a frame'):
        Sequence.load(folder)


def label(folder, boxes, frames=3):
    """Label people as filled boxes, {person: (x, y, width, height)}."""
    (folder / 'labels').mkdir(exist_ok=True)
    for number in range(frames):
        labels = np.zeros((40, 48), np.uint8)
        for person, (x, y, width, height) in boxes.items():
            labels[y : y + height, x : x + width] = person
        cv2.imwrite(str(folder / 'labels' / f'{number:04d}.png'), labels)


def test_without_labels_the_person_of_the_mask_is_number_one(folder):
    sequence = Sequence.load(folder)
    np.testing.assert_array_equal(sequence.labels(1) == 1, sequence.truth(1) == 255)
    assert sequence.attendance.people == (1,)
    assert sequence.starts == {0: (sequence.initial_box,)}
    sequence.masks.pop(1)
    assert sequence.labels(1) is None


def test_labelled_people_start_from_their_true_boxes(folder):
    label(folder, {1: (4, 6, 10, 29), 2: (30, 8, 8, 20)})
    sequence = Sequence.load(folder)
    assert sequence.attendance.people == (1, 2)
    assert sequence.starts == {0: (sequence.initial_box, Box(30, 8, 8, 20))}
    rewrite(folder, initial_box=None)
    sequence = Sequence.load(folder)
    assert sequence.initial_box is None
    assert sequence.starts == {0: (Box(4, 6, 10, 29), Box(30, 8, 8, 20))}


def test_boxes_can_be_given_for_everybody(folder):
    label(folder, {1: (4, 6, 10, 29), 2: (30, 8, 8, 20)})
    rewrite(folder, initial_boxes=[[3, 5, 12, 31], {'frame': 2, 'box': [29, 8, 9, 21]}])
    sequence = Sequence.load(folder)
    assert sequence.starts == {0: (Box(3, 5, 12, 31),), 2: (Box(29, 8, 9, 21),)}


def test_labels_of_frames_that_do_not_exist_are_refused(folder):
    label(folder, {1: (4, 6, 10, 29)}, frames=4)
    with pytest.raises(SequenceError, match=r'0003\.png is the label image of a frame'):
        Sequence.load(folder)

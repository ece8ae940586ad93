# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest

from gait_segmentation.errors import SequenceError
from gait_segmentation.geometry import Box
from gait_tools.evaluation.description import Description

FRAMES = {number: Path(f'{number}.png') for number in range(3)}
SIZE = (48, 40)


def described(**changes: Any) -> Description:
    values = {'fps': 25, 'initial_box': [3, 5, 12, 31], 'initial_frame': 0, **changes}
    known = {name: value for name, value in values.items() if value is not None}
    return Description(Path('walk/sequence.yaml'), known)


def use(about: Description) -> None:
    about.fps()
    about.initial_frame(FRAMES)
    about.boxes(FRAMES, SIZE, needed=True)


def test_what_is_written_is_read(tmp_path: Path) -> None:
    path = tmp_path / 'sequence.yaml'
    path.write_text('fps: 12.5\ninitial_box: [1, 2, 3, 4]\ninitial_frame: 2\n')
    about = Description.read(path)
    assert (about.fps(), about.initial_frame(FRAMES)) == (12.5, 2)
    assert about.boxes(FRAMES, SIZE, needed=True) == {2: (Box(1, 2, 3, 4),)}
    assert not about.has_all_boxes


def test_boxes_of_everybody_replace_that_of_one() -> None:
    about = described(initial_boxes=[{'frame': 2, 'box': [1, 1, 5, 5]}, [2, 2, 6, 6]])
    boxes = about.boxes(FRAMES, SIZE, needed=True)
    assert boxes == {0: (Box(2, 2, 6, 6),), 2: (Box(1, 1, 5, 5),)}
    assert about.has_all_boxes


def test_a_box_may_be_missing_where_people_are_labelled() -> None:
    assert described(initial_box=None).boxes(FRAMES, SIZE, needed=False) == {}


@pytest.mark.parametrize(
    ('changes', 'message'),
    [
        ({'fps': None}, 'has no fps'),
        ({'fps': 0}, 'fps .* must be positive, got 0'),
        ({'fps': 'fast'}, "fps .* must be a number, got 'fast'"),
        ({'fps': float('nan')}, 'fps .* must be a number'),
        ({'initial_box': None}, 'has no initial_box'),
        ({'initial_box': [1, 2, 3]}, 'four numbers'),
        ({'initial_box': [1, 2, 0, 4]}, 'positive width and height'),
        ({'initial_box': [100, 2, 5, 4]}, 'overlap the image of 48x40'),
        ({'initial_box': [0, 0, 1e7, 1e7]}, 'at most 4 times as wide and high as .* 48 x 40'),
        ({'initial_frame': 7}, r'number of a frame \(0 to 2\), got 7'),
        ({'initial_frame': 'first'}, 'number of a frame'),
        ({'initial_frame': [0]}, 'number of a frame'),
        ({'fps': 10**400}, 'fps in .* must be a number'),
        ({'initial_box': [1, 2, 3, 10**400]}, 'must be four numbers'),
    ],
)
def test_values_that_cannot_be_used_are_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(SequenceError, match=message):
        use(described(**changes))


@pytest.mark.parametrize(
    ('boxes', 'message'),
    [
        ([], r'must be a list of boxes, got \[\]'),
        ([{'frame': [0], 'box': [1, 2, 3, 4]}], 'must be the number of a frame'),
        ('here', "must be a list of boxes, got 'here'"),
        ([[1, 2]], 'four numbers'),
        ([{'frame': 9, 'box': [1, 2, 3, 4]}], 'number of a frame from 0 on, got 9'),
        ([{'frame': 1}], 'four numbers x, y, width, height, got None'),
    ],
)
def test_boxes_that_cannot_be_used_are_refused(boxes: Any, message: str) -> None:
    with pytest.raises(SequenceError, match=message):
        use(described(initial_boxes=boxes))


@pytest.mark.parametrize('text', ['{', '- 1\n', 'fps: [1', b'\xff\xfe\x00'])
def test_broken_yaml_is_refused(tmp_path: Path, text: str | bytes) -> None:
    path = tmp_path / 'sequence.yaml'
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(SequenceError, match=r'sequence\.yaml'):
        Description.read(path)


def test_a_pipe_is_no_description(tmp_path: Path) -> None:
    path = tmp_path / 'sequence.yaml'
    os.mkfifo(path)
    with pytest.raises(SequenceError, match=r'sequence\.yaml cannot be read: it is a pipe'):
        Description.read(path)

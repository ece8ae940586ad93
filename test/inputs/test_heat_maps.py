# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import replace

import cv2
import numpy as np
import pytest

from gait_segmentation.errors import InputError, SequenceError
from gait_segmentation.inputs import Frame
from gait_segmentation.inputs.heat_maps import open_heat_maps
from test.inputs.bags import image_fields, stamp, write_bag2

FRAME = Frame(0, stamp(0), 0, 0, '', (4, 6), None)


def shown(maps, number):
    frame = replace(FRAME, number=number, stamp_ns=stamp(number))
    return [(stamp_ns, int(read()[0, 0])) for stamp_ns, read in maps(frame)]


def test_maps_of_a_folder_are_told_by_number_or_stamp(tmp_path):
    for name, value in (('0000', 1), ('map_2', 2), (f'{stamp(3)}', 3)):
        cv2.imwrite(str(tmp_path / f'{name}.png'), np.full((4, 6), value, np.uint8))
    maps = open_heat_maps(str(tmp_path), tmp_path)
    assert [shown(maps, number) for number in range(4)] == [
        [(stamp(0), 1)],
        [],
        [(stamp(2), 2)],
        [(stamp(3), 3)],
    ]


def test_what_is_no_place_of_maps_is_refused(tmp_path):
    with pytest.raises(SequenceError, match='no images named by number or stamp'):
        open_heat_maps(str(tmp_path), tmp_path)
    with pytest.raises(SequenceError, match=r'no such folder, and .* is no bag'):
        open_heat_maps('/heat_map', tmp_path)


@pytest.mark.parametrize('encoding', ['mono8', '32FC1'])
def test_maps_on_a_topic_come_up_to_the_frame(tmp_path, encoding):
    messages = []
    for number in (0, 1, 4):
        value = np.full((4, 6), 51 * number, np.uint8)
        if encoding == '32FC1':
            value = (value / 255).astype(np.float32)
        message = image_fields(value, stamp(number), encoding)
        message.data = value.view(np.uint8).reshape(-1)
        messages.append(message)
    frames = [image_fields(np.zeros((8, 12, 3), np.uint8), stamp(0))]
    bag = write_bag2(tmp_path / 'walk', {'/image': frames, '/heat_map': messages})
    maps = open_heat_maps('/heat_map', bag)
    assert [shown(maps, number) for number in (0, 3, 4, 5)] == [
        [(stamp(0), 0)],
        [(stamp(1), 51)],
        [(stamp(4), 204)],
        [],
    ]
    with pytest.raises(SequenceError, match='topic /nothing is not there'):
        open_heat_maps('/nothing', bag)


def test_what_is_no_map_is_refused_when_it_is_read(tmp_path):
    messages = [image_fields(np.zeros((4, 6, 3), np.uint8), stamp(n)) for n in range(2)]
    messages.insert(0, image_fields(np.zeros((4, 6), np.uint8), stamp(0), 'mono8'))
    bag = write_bag2(tmp_path / 'walk', {'/heat_map': messages})
    maps = open_heat_maps('heat_map', bag)
    first, second = (read for _, read in maps(replace(FRAME, stamp_ns=stamp(0))))
    assert first().shape == (4, 6)
    with pytest.raises(InputError, match='must be mono8, 8UC1, mono16 or 32FC1'):
        second()

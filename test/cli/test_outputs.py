# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where outputs may be, what becomes of those that are there, and of those broken off."""

import csv
import math
import pickle
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

from gait_segmentation.cli.lockstep import Replayed
from gait_segmentation.cli.outputs import (
    OUTPUTS,
    BagOutput,
    CsvOutput,
    MasksOutput,
    OpenGaitOutput,
    OverlayOutput,
    centred_silhouette,
)
from gait_segmentation.cli.replay import main
from gait_segmentation.errors import SequenceError
from gait_segmentation.inputs import open_input
from test.cli.results import STEP_NS, replayed
from test.inputs.bags import image_fields, stamp, write_bag2
from test.test_files import room_for
from test.walkers import clip

SHAPE = (240, 320)
TOPICS = {
    '/person_0/box': 'geometry_msgs/msg/PolygonInstanceStamped',
    '/person_0/likelihood': 'sensor_msgs/msg/Image',
    '/person_0/matched_box': 'geometry_msgs/msg/PolygonInstanceStamped',
    '/person_0/refined_box': 'geometry_msgs/msg/PolygonInstanceStamped',
    '/person_0/shape_prior': 'sensor_msgs/msg/Image',
    '/person_0/gait': 'sensor_msgs/msg/JointState',
    '/person_0/mask': 'sensor_msgs/msg/Image',
    '/mask': 'sensor_msgs/msg/Image',
    '/labels': 'sensor_msgs/msg/Image',
}
NOT_OWN = 'was not made by gait_replay and is not replaced'


def copied(path: Path) -> dict[Path, bytes]:
    """Return what is in all files of a folder."""
    return {each: each.read_bytes() for each in sorted(path.rglob('*')) if each.is_file()}


@pytest.mark.parametrize(
    ('option', 'place'),
    [
        ('--overlay', 'hard.mp4'),
        ('--overlay', 'io/walk.mp4'),
        ('--masks', 'io'),
        ('--csv', 'bank/a.csv'),
        ('--csv', 'params.yaml'),
        ('--opengait', 'maps'),
    ],
)
def test_what_is_read_is_never_an_output(
    tmp_path: Path, capsys, monkeypatch, option: str, place: str
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ('io', 'bank', 'maps'):
        Path(name).mkdir()
    # What was broken off, and is the input now, is not removed either.
    film = Path('io/walk.partial.mp4')
    OverlayOutput(film, (320, 240), 30.0).close(complete=True)
    Path('hard.mp4').hardlink_to(film)
    Path('params.yaml').write_text('{"/**": {ros__parameters: {}}}')
    before = copied(tmp_path)
    read = ['--bank', 'bank', '--params', 'params.yaml', '--heat-map', 'maps']
    assert main([str(film), *read, option, place, '--force']) == 2
    said = capsys.readouterr().err
    assert said.startswith(f'gait_replay: error: {option} ')
    assert ', which would be changed' in said
    assert copied(tmp_path) == before


def foreign(place: str, tmp_path: Path) -> None:
    """Make what gait_replay has not made, but might be taken for its output."""
    path = tmp_path / place
    path.parent.mkdir(parents=True, exist_ok=True)
    if place == 'out/walk':
        write_bag2(path, {'/mask': [image_fields(clip()[0].image, stamp(0))]})
    elif path.suffix in ('.png', '.jpg'):
        cv2.imwrite(str(path), clip()[0].image)
    elif path.suffix == '.avi':
        # As a camera writes them.
        cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*'MJPG'), 30, (320, 240)).release()
    else:
        path.write_text('frame,grade\n1,A\n')


@pytest.mark.parametrize(
    ('options', 'place', 'said'),
    [
        ([], 'out/walk', 'out/walk'),
        ([], 'out/walk.partial/thesis.tex', 'out/walk.partial'),
        (['--masks', 'masks'], 'masks/0000.png', 'masks'),
        (['--csv', 'table'], 'table/a.csv', 'table'),
        (['--csv', 'marks.csv'], 'marks.csv', 'marks.csv'),
        (['--tracks', 'marks.csv'], 'marks.csv', 'marks.csv'),
        (['--overlay', 'marks.txt'], 'marks.txt', 'marks.txt'),
        (['--overlay', 'a.jpg'], 'a.jpg', 'a.jpg'),
        (['--overlay', 'a.avi'], 'a.avi', 'a.avi'),
        (['--opengait', 'gait'], 'gait/walk/thesis.tex', 'gait/walk'),
    ],
)
def test_only_an_own_output_counts_as_done_and_is_replaced(
    given: list[str], tmp_path: Path, capsys, monkeypatch, options: list[str],
    place: str, said: str,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    foreign(place, tmp_path)
    before = copied(tmp_path)
    for force in ([], ['--force']):
        assert main([*given, *options, *force]) == 2
        assert f'{said} {NOT_OWN}' in capsys.readouterr().err
    assert copied(tmp_path) == before


def test_all_own_outputs_are_known_again_and_made_anew_with_force(
    given: list[str], tmp_path: Path, capsys, monkeypatch
) -> None:
    monkeypatch.chdir(tmp_path)
    command = [*given, '--count', '6', '--masks', 'masks', '--csv', 'a.csv', '--opengait', 'gait']
    command += ['--overlay', 'film.avi', '--tracks', 'a.txt', '--detector', 'none']
    assert main(command) == 0
    film = tmp_path / 'film.avi'
    before, first = film.stat().st_mtime_ns, copied(tmp_path)
    assert main(command) == 0
    assert 'done before' in capsys.readouterr().out
    # Only what is not there is made.
    (tmp_path / 'a.csv').unlink()
    assert main(command) == 0
    assert (tmp_path / 'a.csv').exists()
    assert film.stat().st_mtime_ns == before
    assert main([*command, '--force']) == 0
    assert copied(tmp_path) == first
    assert film.stat().st_mtime_ns > before
    # The one image that cannot be read is in the film, too.
    assert len(list(open_input(film).images())) == 6


def test_a_full_disk_is_one_line(given: list[str], tmp_path: Path, capsys) -> None:
    with room_for(1000):
        assert main([*given, '--count', '3']) == 2
    (error,) = [line for line in capsys.readouterr().err.splitlines() if 'error' in line]
    assert re.search(r'out/walk\S*: File too large$', error)


def figure(left: int, width: int, height: int = 128) -> np.ndarray:
    mask = np.zeros((200, 300), np.uint8)
    mask[20 : 20 + height, left : left + width] = 255
    return mask


def test_a_silhouette_fills_the_height_and_stands_in_the_middle() -> None:
    silhouette = centred_silhouette(figure(100, 40))
    expected = np.zeros((64, 64), np.uint8)
    expected[:, 22:42] = 255
    assert silhouette.dtype == np.uint8
    # The centre is a whole column, and cubic interpolation rings at edges.
    assert abs(silhouette.astype(int) - expected).max(axis=0)[24:40].max() == 0
    assert (silhouette > 127).sum(axis=1).tolist() == [20] * 64
    # At the border the rest is empty, and wide ones are cut off.
    for left in (0, 260):
        assert abs(int((centred_silhouette(figure(left, 40)) > 127).sum()) - 20 * 64) <= 64
    assert (centred_silhouette(figure(0, 300)) > 127).all()
    # It stands where most of it is, not between the back and the hand of an arm that is held out.
    mask = figure(100, 20)
    mask[60:70, 100:160] = 255
    assert np.flatnonzero(centred_silhouette(mask)[0] > 127).mean() == pytest.approx(31, abs=2)


def test_a_silhouette_ends_with_its_last_row() -> None:
    mask = np.zeros((100, 100), np.uint8)
    # As high as it is to be.
    mask[10:74, 40:60] = 255
    mask[73, 50:] = 0
    assert (centred_silhouette(mask) > 127).sum(axis=1).tolist() == [20] * 63 + [10]


def test_walks_are_written_by_person_and_direction(tmp_path: Path) -> None:
    output = OpenGaitOutput(tmp_path / 'walk')
    for index in range(6):
        # Averaged on the circle.
        left = math.pi - 0.5 if index % 2 else 0.3 - math.pi
        people = [(0, figure(10, 40), 0.0), (2, figure(0, 3, height=13), 0.0)]
        people += [(3, figure(10 * index, 40), left), (5, figure(10, 40), math.pi / 2)]
        # Too few frames of one, and hardly anything of another.
        people += [(4, figure(200, 40), 0.0)] * (index < 4)
        output.add(*replayed(index, people))
    output.close(complete=True)
    found = sorted((tmp_path / 'walk').rglob('*.*'))
    assert [str(each.relative_to(tmp_path / 'walk')) for each in found] == [
        'person-003/180/180.pkl',
        'person-005/090/090.pkl',
    ]
    walk = pickle.loads(found[0].read_bytes())
    assert (walk.shape, walk.dtype) == ((6, 64, 64), np.uint8)
    assert [p.name for p in tmp_path.iterdir()] == ['walk']


@pytest.mark.parametrize('kind', [MasksOutput, CsvOutput, BagOutput])
def test_what_was_killed_is_replaced(kind: Any, tmp_path: Path) -> None:
    kind(tmp_path / 'walk').finish()
    kind(tmp_path / 'walk').close(complete=True)
    assert [path.name for path in tmp_path.iterdir()] == ['walk']


def test_a_row_says_where_somebody_is_and_how_they_walk(tmp_path: Path) -> None:
    output = CsvOutput(tmp_path / 'a.csv')
    mask = np.zeros((60, 40), np.uint8)
    mask[10:50, 5:25] = 255
    nobody = np.zeros_like(mask)
    output.add(*replayed(2, [(7, mask, 0.3), (0, nobody, 0.0)]))
    output.close(complete=True)
    (row,) = csv.DictReader((tmp_path / 'a.csv').read_text().splitlines())
    box = [float(row[f'box_{side}_px']) for side in ('x', 'y', 'width', 'height')]
    assert box == [5, 10, 20, 40]
    assert (row['frame'], row['slot'], row['track_id'], row['mask_px']) == ('2', '0', '7', '800')
    # 0.9 strides a second.
    assert (row['gait_phase_strides'], row['cadence_steps_per_min']) == ('0.2500', '108.0')
    assert (row['azimuth_rad'], row['match_confidence']) == ('0.3000', '0.700')


@pytest.mark.parametrize('name', ['file:walk.mp4', '100%03d.mp4', '-ä [1].mp4'])
def test_the_name_of_a_film_is_but_a_name(name: str, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    OverlayOutput(Path(name), (64, 48), 25.0).close(complete=True)
    assert [path.name for path in tmp_path.iterdir()] == [name]


def test_a_film_that_cannot_be_begun_says_why(tmp_path: Path) -> None:
    with room_for(100), pytest.raises(OSError, match='File too large') as caught:
        OverlayOutput(tmp_path / 'walk.mp4', (64, 48), 25.0)
    assert 'walk' in str(caught.value.filename)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize('kind', OUTPUTS)
def test_an_output_is_made_by_one_at_a_time(kind: Any, tmp_path: Path) -> None:
    place = tmp_path / 'walk.mp4'
    first = kind(place, (64, 48), 25.0)
    for _ in range(2):
        with pytest.raises(SequenceError, match='is being made by another command'):
            kind(place, (64, 48), 25.0)
    first.close(complete=False)
    kind(place, (64, 48), 25.0).close(complete=True)
    assert [path.name for path in tmp_path.iterdir()] == ['walk.mp4']


def test_a_film_that_lacks_frames_since_the_disk_is_full_is_an_error(tmp_path: Path) -> None:
    output = OverlayOutput(tmp_path / 'walk.mp4', (300, 200), 25.0)
    noise = np.random.default_rng(0).integers(0, 256, (200, 300, 3)).astype(np.uint8)
    mask = np.zeros(noise.shape[:2], np.uint8)
    for index in range(30):
        frame, result = replayed(index, [(0, mask, 0.0)])
        with room_for(10_000):
            output.add(replace(frame, image=noise), result)
    with room_for(10_000), pytest.raises(SequenceError, match='must have 30 frames'):
        output.finish()
    output.close(complete=False)


def frame(index: int) -> Replayed:
    mask = np.zeros(SHAPE, np.uint8)
    mask[50:200, 30 + index : 90 + index] = 255
    return replayed(index, [(7, mask, 0.3)])


def contents(path: Path) -> list[tuple[str, int, bytes]]:
    with Reader(path) as reader:
        return [(c.topic, stamp, bytes(data)) for c, stamp, data in reader.messages()]


def test_the_topics_are_those_of_the_nodes(tmp_path: Path) -> None:
    output = BagOutput(tmp_path / 'walk')
    for index in range(5):
        output.add(*frame(index))
    output.close(complete=True)
    assert sorted(p.name for p in (tmp_path / 'walk').iterdir()) == ['metadata.yaml', 'walk.mcap']
    with Reader(tmp_path / 'walk') as reader:
        assert {name: topic.msgtype for name, topic in reader.topics.items()} == {
            **TOPICS,
            '/image_size': 'sensor_msgs/msg/RegionOfInterest',
        }
        counts = {name: topic.msgcount for name, topic in reader.topics.items()}
        assert counts == {**dict.fromkeys(TOPICS, 5), '/image_size': 1}
        stamps = [stamp for _, stamp, _ in reader.messages()]
        assert reader.duration == 4 * STEP_NS + 1
        assert stamps == sorted(stamps)
        store = get_typestore(Stores.ROS2_JAZZY)
        for connection, stamp, data in reader.messages():
            if connection.topic != '/image_size':
                header: Any = store.deserialize_cdr(data, connection.msgtype).header
                assert header.frame_id == 'head_camera'
                assert header.stamp.sec * 10**9 + header.stamp.nanosec == stamp - 1000


def test_a_header_that_has_no_stamp_has_none_in_the_bag(tmp_path: Path) -> None:
    output, one = BagOutput(tmp_path / 'walk'), frame(0)
    output.add(replace(one.frame, header_ns=0), one.result)
    output.close(complete=True)
    store = get_typestore(Stores.ROS2_JAZZY)
    found = {topic: data for topic, _, data in contents(tmp_path / 'walk')}
    for topic, kind in TOPICS.items():
        time: Any = store.deserialize_cdr(found[topic], kind).header.stamp
        assert (time.sec, time.nanosec) == (0, 0), topic


@pytest.mark.filterwarnings('ignore::DeprecationWarning')
def test_messages_are_those_of_the_nodes(tmp_path: Path) -> None:
    pytest.importorskip('rclpy', reason='needs ROS 2: rclpy cannot be imported')
    from rclpy.serialization import deserialize_message, serialize_message
    from sensor_msgs.msg import RegionOfInterest
    from std_msgs.msg import Header

    from gait_segmentation.ros.messages import box_message, gait_message, image_message
    from gait_segmentation.streams.fields import matched_corners, refined_corners, track_corners

    output = BagOutput(tmp_path / 'walk')
    one = frame(3)
    output.add(*one)
    output.close(complete=True)
    (person,) = one.result.people
    header = Header(frame_id='head_camera')
    header.stamp.sec, header.stamp.nanosec = divmod(one.frame.header_ns, 10**9)
    expected = {
        '/image_size': RegionOfInterest(height=240, width=320),
        '/person_0/box': box_message(track_corners(person.track), 7, header),
        '/person_0/likelihood': image_message(person.track.likelihood, header),
        '/person_0/matched_box': box_message(matched_corners(person.match), 7, header),
        '/person_0/refined_box': box_message(refined_corners(person.match), 7, header),
        '/person_0/shape_prior': image_message(person.match.shape_prior, header),
        '/person_0/gait': gait_message(person.match, header),
        '/person_0/mask': image_message(person.segmentation.mask, header),
        '/mask': image_message(one.result.mask, header),
        '/labels': image_message(one.result.labels, header),
    }
    found = {topic: data for topic, _, data in contents(tmp_path / 'walk')}
    assert found.keys() == expected.keys()
    for topic, message in expected.items():
        # Not byte by byte: rclpy leaves to chance what lies between aligned fields.
        sent = bytes(serialize_message(message))
        kind = type(message)
        assert deserialize_message(found[topic], kind) == deserialize_message(sent, kind), topic
        assert len(found[topic].rstrip(b'\0')) <= len(sent) <= len(found[topic]) + 8, topic

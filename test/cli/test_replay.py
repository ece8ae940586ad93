# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""gait_replay from end to end on a short synthetic bag."""

import contextlib
import csv
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

from gait_segmentation.cli import jobs
from gait_segmentation.cli.jobs import replay
from gait_segmentation.cli.outputs import OUTPUTS, TABLE_COLUMNS
from gait_segmentation.cli.replay import main, make_jobs, names_of, parser
from gait_segmentation.detector.detection import Detection
from gait_segmentation.detector.networks import DetectorConfig, Networks
from gait_segmentation.errors import ConfigError
from gait_segmentation.geometry import Box
from gait_segmentation.inputs import open_input
from gait_segmentation.pipeline import Pipeline, PipelineConfig
from test.cli.conftest import BROKEN, FRAMES
from test.inputs.bags import stamp
from test.networks import red_network
from test.walkers import clip, small_bank

ROOT = Path(__file__).parents[2]


def images(path: Path, topic: str) -> list[np.ndarray]:
    return list(open_input(path, topic=topic).images())


def masks_of_pipeline(heat_maps: dict[int, np.ndarray], network: str) -> list[np.ndarray]:
    """Return what the pipeline finds in the frames, and nothing where one cannot be read."""
    config = PipelineConfig(detector=DetectorConfig(network=network))
    pipeline = Pipeline(config, small_bank())
    pipeline.initialize(clip()[0].boxes[0])
    found = []
    for index, frame in enumerate(clip()[:FRAMES]):
        if index == BROKEN:
            found.append(np.zeros(frame.image.shape[:2], np.uint8))
            continue
        (result,) = pipeline.update(frame.image, stamp(index), heat_map=heat_maps.get(index))
        assert result.mask.any()
        found.append(result.mask)
    return found


@pytest.mark.parametrize('maps', ['none', 'folder', 'network'])
def test_every_frame_has_the_pipelines_results(
    maps: str, given: list[str], tmp_path: Path, monkeypatch, capsys
) -> None:
    folder, more, heat_maps, network = tmp_path / 'maps', [], {}, 'people'
    if maps == 'folder':
        network = 'none'
        folder.mkdir()
        for index, frame in enumerate(clip()[:FRAMES]):
            heat = heat_maps[index] = frame.masks[0]
            cv2.imwrite(str(folder / f'{index:04d}.png'), heat)
        # It is in colour, and left out.
        del heat_maps[2]
        cv2.imwrite(str(folder / '0002.png'), cv2.merge([heat, 255 - heat, heat]))
        more = ['--heat-map', str(folder), '--set', 'detector.network=none']
    elif maps == 'network':
        heat_maps = {n: each.image[..., 2] for n, each in enumerate(clip()[:FRAMES])}
        network = 'boxes'
        more = ['--detector', str(red_network(tmp_path, clip()[0].image.shape))]
    assert main([*given, *more]) == 0
    found = images(tmp_path / 'out/walk', '/mask')
    expected = masks_of_pipeline(heat_maps, network)
    np.testing.assert_array_equal([image[:, :, 0] for image in found], expected)
    said = capsys.readouterr().err
    assert ('the heat map of frame 2 is left out' in said) == (maps == 'folder')
    with Reader(tmp_path / 'out/walk') as reader:
        counts = {name: topic.msgcount for name, topic in reader.topics.items()}
        assert counts.pop('/image_size') == 1
        assert set(counts.values()) == {FRAMES}
        store = get_typestore(Stores.ROS2_JAZZY)
        for connection, stamp_ns, data in reader.messages():
            if connection.topic == '/person_0/gait':
                gait: Any = store.deserialize_cdr(data, connection.msgtype)
                # Stamped as recorded; of who is not seen nothing is said.
                assert bool(gait.name) == (stamp_ns - 5_000_000 != stamp(BROKEN))


def test_other_outputs_on_request(given: list[str], tmp_path: Path) -> None:
    masks, film, table = tmp_path / 'masks', tmp_path / 'film.mp4', tmp_path / 'table.csv'
    tracks = tmp_path / 'tracks.txt'
    options = ['--masks', str(masks), '--overlay', str(film), '--csv', str(table)]
    options += ['--tracks', str(tracks), '--detector', 'none']
    assert main([*given, *options, '--start', '1', '--count', '7', '--width', '240']) == 0
    assert sorted(p.name for p in masks.iterdir()) == [f'{n:04d}.png' for n in range(1, 8)]
    mask = cv2.imread(str(masks / '0002.png'), cv2.IMREAD_UNCHANGED)
    assert mask.shape[1] == 240
    assert set(np.unique(mask)) == {0, 255}
    assert len(list(open_input(film).images())) == 7
    with open(table, newline='') as file:
        rows = list(csv.DictReader(file))
    assert tuple(rows[0]) == TABLE_COLUMNS
    assert [int(row['frame']) for row in rows] == [1, 2, 3, 5, 6, 7]
    assert [int(row['stamp_ns']) for row in rows] == [stamp(n) for n in (1, 2, 3, 5, 6, 7)]
    for row in rows:
        assert 0 <= float(row['gait_phase_strides']) < 1
        assert 20 < float(row['box_height_px']) < 200
        assert row['state'] == 'tracked'
    told = [line.split(',') for line in tracks.read_text().splitlines()]
    sides = [f'box_{each}_px' for each in ('x', 'y', 'width', 'height')]
    # MOTChallenge counts frames from 1.
    assert told == [
        [
            str(int(row['frame']) + 1),
            row['track_id'],
            *(row[side] for side in (*sides, 'track_confidence')),
            *['-1'] * 3,
        ]
        for row in rows
    ]


def test_of_outputs_that_are_there_it_is_said_that_they_stay(
    given: list[str], tmp_path: Path, capsys
) -> None:
    bag, table, tracks = tmp_path / 'out/walk', tmp_path / 'a.csv', tmp_path / 'a.txt'
    command = [*given, '--count', '2', '--detector', 'none', '--csv', str(table)]
    assert main(command) == 0
    assert 'left as it is' not in capsys.readouterr().out
    # Of another input, too: its bag is made, and the table is the old one.
    assert main([*command, '--out', str(tmp_path / 'other'), '--tracks', str(tracks)]) == 0
    assert f'left as it is: {table}; --force' in capsys.readouterr().out
    assert main(command) == 0
    assert f'left as it is: {bag}, {table}; --force' in capsys.readouterr().out
    assert main([*command, '--force']) == 0
    assert 'left as it is' not in capsys.readouterr().out


def test_an_interruption_leaves_a_bag_that_can_be_read(given: list[str], tmp_path: Path) -> None:
    table = tmp_path / 'table.csv'
    walks = tmp_path / 'walks'
    more = ['--csv', str(table), '--opengait', str(walks), '--detector', 'none']
    (job,) = make_jobs(parser().parse_args([*given, *more]))
    stops = iter([False, False, True])
    report = replay(job, small_bank(), lambda: next(stops))
    assert (report.interrupted, report.frames) == (True, 3)
    assert sorted(report.left) == [
        tmp_path / 'out/walk.partial',
        tmp_path / 'table.partial.csv',
        walks / 'walk.partial',
    ]
    assert len(images(tmp_path / 'out/walk.partial', '/mask')) == 3
    assert len((tmp_path / 'table.partial.csv').read_text().splitlines()) == 4
    assert replay(job, small_bank(), lambda: False).frames == FRAMES
    assert sorted(p.name for p in tmp_path.iterdir()) == ['out', 'table.csv', 'walks']
    assert [p.name for p in (tmp_path / 'out').iterdir()] == ['walk']
    assert [p.name for p in walks.iterdir()] == ['walk']


def test_every_output_is_documented() -> None:
    said = (ROOT / 'docs/replay.md').read_text()
    assert [kind.option for kind in OUTPUTS if f'`{kind.option} ' not in said] == ['--out']
    assert '[--out DIR]' in said


def test_names_tell_inputs_apart(tmp_path: Path) -> None:
    paths = [tmp_path / 'a/walk.mp4', tmp_path / 'b/walk.bag', tmp_path / 'b/run.mp4']
    assert names_of(paths) == ['a_walk', 'b_walk', 'run']
    with pytest.raises(ConfigError, match='2 inputs have the name a_walk'):
        names_of([tmp_path / 'a/walk.mp4', tmp_path / 'a/walk.bag'])
    # A folder is called by all of its name.
    for name in ('take.1', 'take.2'):
        (tmp_path / name).mkdir()
    assert names_of([tmp_path / 'take.1', tmp_path / 'take.2']) == ['take.1', 'take.2']


@pytest.mark.parametrize(
    ('options', 'reason'),
    [
        (['--box', '5000', '0', '10', '10'], 'not lie outside of the image'),
        (['--jobs', '0'], '--jobs must be from 1 to 1024, got 0'),
        (['--overlay', 'x.nonsense'], 'cannot be written as a film'),
        (['picture.jpg'], 'picture.jpg is a single picture: give the folder'),
        (['--set', 'max_peple=2'], 'one parameter: people.max_people, '),
        (['--params', 'typo.yaml'], 'no parameter max_peple: did you mean max_people?'),
    ],
)
def test_what_cannot_be_used_is_said(
    given: list[str], options: list[str], reason: str, tmp_path: Path, capfd, monkeypatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path('picture.jpg').touch()
    Path('typo.yaml').write_text('/**:\n  ros__parameters:\n    max_peple: 3\n')
    # Inputs before the options, whose values may be several.
    place = 0 if options[0] == 'picture.jpg' else len(given)
    assert main([*given[:place], *options, *given[place:]]) == 2
    assert reason in capfd.readouterr().err
    assert not list(tmp_path.rglob('walk*'))


@pytest.mark.parametrize(
    ('network', 'told'),
    [('none', 'nobody looked for people (detector.network: none)'), ('boxes', 'looked once, ')],
)
def test_if_nobody_is_found_it_is_said_who_looked(
    network: str, told: str, tmp_path: Path, capfd
) -> None:
    (tmp_path / 'empty').mkdir()
    cv2.imwrite(str(tmp_path / 'empty/0000.png'), np.full((120, 160, 3), 90, np.uint8))
    given = [str(tmp_path / 'empty'), '--out', str(tmp_path / 'out'), '--detector', network]
    assert main(given) == 0
    assert f'no person was found: {"the detector (boxes) " * (network == "boxes")}{told}' in (
        capfd.readouterr().err
    )


@pytest.mark.parametrize('degrees', [90, 180, 270])
def test_if_the_camera_lies_it_is_said_how_to_turn_the_picture(
    degrees: int, tmp_path: Path, capfd, monkeypatch
) -> None:
    def upright(image: np.ndarray) -> list[Detection]:
        box = Box.around(cv2.inRange(image, (200, 200, 200), (255, 255, 255)))
        # With the head above.
        clear = box.height > box.width and box.center_y < image.shape[0] / 2
        return [Detection(box, 0.8)] if clear else []

    monkeypatch.setattr(jobs, 'open_networks', lambda *_: Networks(upright))
    image = np.zeros((160, 160, 3), np.uint8)
    image[20:80, 70:90] = 255
    (tmp_path / 'lying').mkdir()
    cv2.imwrite(str(tmp_path / 'lying/0000.png'), np.rot90(image, degrees // 90))
    assert main([str(tmp_path / 'lying'), '--out', str(tmp_path / 'out')]) == 0
    assert f'with --rotate {degrees} it sees somebody' in capfd.readouterr().err


def test_a_topic_is_given_once(given: list[str], capfd) -> None:
    read = []
    with contextlib.suppress(SystemExit):
        (job,) = make_jobs(parser().parse_args([*given, '--topic', '/left']))
        read.append(job.reading['topic'])
    assert read == ['/left']
    with pytest.raises(SystemExit):
        main([*given, '--topic', '/left', '--topic', '/right'])
    assert '--topic: may be given once' in capfd.readouterr().err


def test_a_parameter_file_is_read_as_the_nodes_read_it(given: list[str], tmp_path: Path) -> None:
    file = tmp_path / 'params.yaml'
    file.write_text(
        '/**:\n  ros__parameters:\n    backlog: 3\n    people.max_people: 2\n'
        '    initial_box: [1, 2, 30, 40]\n    bank: of_file.npz\n'
        '/robot/gait_pipeline:\n  ros__parameters:\n    matching: {lag: 4, window: 1}\n'
        'camera:\n  ros__parameters:\n    matching.lag: 9\n'
    )
    command = [given[0], '--out', given[-1], '--params', str(file)]
    (job,) = make_jobs(parser().parse_args(command))
    assert (job.config.people.max_people, job.config.matching.lag) == (2, 4)
    assert job.config.matching.window == 1.0
    assert job.box is not None
    assert (job.box.x, job.box.height, job.bank) == (1, 40, 'of_file.npz')
    # What the command line says counts more.
    given = [*command, '--bank', 'asked_for.npz', '--box', '5', '6', '7', '8']
    (job,) = make_jobs(parser().parse_args(given))
    assert job.box is not None
    assert (job.box.x, job.box.height, job.bank) == (5, 8, 'asked_for.npz')


def test_a_preset_is_what_parameter_file_and_options_begin_with(
    given: list[str], tmp_path: Path
) -> None:
    file = tmp_path / 'params.yaml'
    file.write_text('/**:\n  ros__parameters:\n    matching: {lag: 4, blur: 5}\n')
    plain, paper, mine = (
        make_jobs(parser().parse_args([given[0], *more]))[0].config
        for more in (
            [],
            ['--preset', 'paper'],
            ['--preset', 'paper', '--params', str(file), '--set', 'matching.blur=7'],
        )
    )
    assert plain == PipelineConfig()
    assert (paper.tracking.method, paper.segmentation.prior) == ('adaptive_mean_shift', 'paper')
    # Whatever has a switch is not the paper's, and neither is the rim taken off a box.
    switches = {**vars(paper.tracking), **vars(paper.matching), **vars(paper.segmentation)}
    assert [name for name, on in switches.items() if name.startswith('use_') and on] == []
    assert paper.tracking.box_margin == 0
    assert (mine.matching.lag, mine.matching.blur) == (4, 7)
    assert mine.segmentation == paper.segmentation


def test_a_detector_that_cannot_be_used_is_said_before_anything_is_written(
    given: list[str], tmp_path: Path, capsys
) -> None:
    assert main([*given, '--detector', str(tmp_path / 'none.onnx')]) == 2
    assert 'none.onnx cannot be loaded: No such file' in capsys.readouterr().err
    with pytest.raises(SystemExit):
        main([*given, '--detector', 'people', '--heat-map', str(tmp_path)])
    assert '--heat-map: not allowed with argument --detector' in capsys.readouterr().err
    assert not (tmp_path / 'out').exists()

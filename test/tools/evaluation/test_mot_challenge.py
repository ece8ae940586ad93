# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from pathlib import Path

import numpy as np
import pytest

from gait_segmentation.errors import SequenceError
from gait_segmentation.geometry import Box
from gait_tools.evaluation.mot_challenge import MotSequence, mot_report, read_tracks

from .fakes import write_mot


def scores(folder: Path, tracks: dict[int, dict[int, Box]]) -> dict:
    pytest.importorskip('motmetrics')
    return mot_report({'walk': MotSequence.load(folder).compared(tracks)})['sequences']['walk']


def at(x: float) -> Box:
    return Box(x, 5, 10, 20)


def test_columns_say_who_counts(tmp_path: Path) -> None:
    box = '10,5,10,20'
    lines = [
        f'1,1,{box}', f'1,2,{box},1', f'1,3,{box},1,1,0.5', f'1,4,{box},1,1',
        # A place in metres follows in MOT15.
        f'1,5,{box},1,-3.5,2,0', '', f'3,6,{box},1,-1,-1,-1',
        f'1,7,{box},0', f'1,8,{box},0,1,1', f'1,9,{box},1,7,1', f'1,10,{box},0,-1,-1,-1',
    ]  # fmt: skip
    found = MotSequence.load(write_mot(tmp_path / 'walk', lines))
    assert {number: set(boxes) for number, boxes in found.people.items()} == {
        1: {1, 2, 3, 4, 5},
        3: {6},
    }
    assert set(found.ambiguous[1]) == {7, 8, 9, 10}
    assert found.people[3][6] == at(10)
    assert (found.name, found.images.name, found.fps) == ('walk', 'img1', 30)


def test_a_file_says_where_images_are_and_how_fast(tmp_path: Path) -> None:
    info = '[Sequence]\nname=walk\nimDir=pictures\nframeRate=14\nseqLength=3\n'
    folder = write_mot(
        tmp_path / 'walk', ['3,1,1,1,9,9,1,1,1'], info, [np.zeros((20, 30, 3), np.uint8)] * 3
    )
    (folder / 'img1').rename(folder / 'pictures')
    source = MotSequence.load(folder).source()
    assert (source.fps, source.total) == (14, 3)
    next((folder / 'pictures').iterdir()).unlink()
    with pytest.raises(SequenceError, match=r'has boxes in frame 3, but .*pictures has 2 images'):
        MotSequence.load(folder).source()


def test_identities_are_scored(tmp_path: Path) -> None:
    lines = [
        f'{n},{person},{50 * person},5,10,20,1,1,1' for n in range(1, 11) for person in (1, 2)
    ]
    folder = write_mot(tmp_path / 'walk', lines)
    tracks = {n: {7: at(50), 8: at(100)} for n in range(1, 11)}
    assert scores(folder, tracks) == {
        'people': 2, 'mota': 1, 'idf1': 1, 'recall': 1, 'precision': 1, 'id_switches': 0,
    }  # fmt: skip
    # One has another id from the fifth frame on, nobody is in two, and somebody is imagined.
    for n in range(5, 11):
        tracks[n][9] = tracks[n].pop(8)
    del tracks[1], tracks[2]
    tracks[3][5] = at(200)
    numbers = scores(folder, tracks)
    assert numbers['recall'] == pytest.approx(16 / 20)
    assert numbers['precision'] == pytest.approx(16 / 17)
    assert numbers['id_switches'] == 1
    assert numbers['mota'] == pytest.approx(1 - (4 + 1 + 1) / 20)
    assert numbers['idf1'] == pytest.approx(2 * (8 + 6) / (20 + 17))
    assert scores(folder, {}) == {
        'people': 2, 'mota': 0, 'idf1': 0, 'recall': 0, 'precision': None, 'id_switches': 0,
    }  # fmt: skip


def test_who_is_ambiguous_is_neither_right_nor_wrong(tmp_path: Path) -> None:
    # A person, a cyclist in the same place but for 2 pixels, and a statue elsewhere.
    lines = ['1,1,10,5,10,20,1,1,1', '1,2,12,5,10,20,1,4,1', '1,3,80,5,10,20,0,1,1']
    folder = write_mot(tmp_path / 'walk', lines)
    for tracks, precision in (
        ({1: at(10), 3: at(80)}, 1),
        ({1: at(10), 2: at(12), 3: at(82)}, 1),
        ({1: at(10), 3: at(86)}, 0.5),
        ({1: at(10), 2: at(80), 3: at(80)}, 0.5),
    ):
        numbers = scores(folder, {1: tracks})
        assert (numbers['recall'], numbers['people']) == (1, 1)
        assert numbers['precision'] == precision


def test_all_frames_count_alike_in_the_end(tmp_path: Path) -> None:
    pytest.importorskip('motmetrics')
    lines = [f'{n},1,10,5,10,20' for n in range(1, 10)]
    long = MotSequence.load(write_mot(tmp_path / 'long', lines))
    short = MotSequence.load(write_mot(tmp_path / 'short', lines[:1]))
    report = mot_report({'long': long.compared({}), 'short': short.compared({1: {1: at(10)}})})
    assert report['sequences']['short']['recall'] == 1
    assert report['overall']['recall'] == pytest.approx(0.1)
    assert report['overall']['people'] == 2


@pytest.mark.parametrize(
    ('line', 'reason'),
    [
        ('1,1,2,3,4', "line 2 must be numbers frame,id,x,y,width,height .* got '1,1,2,3,4'"),
        ('1,1,2,3,x,5', "line 2 must be numbers .* got '1,1,2,3,x,5'"),
        ('0,1,2,3,4,5', 'line 2: the frame must be a whole number from 1 on, got 0'),
        ('nan,1,2,3,4,5', 'line 2: the frame must be a whole number from 1 on, got nan'),
        ('1,-1,2,3,4,5', 'line 2: the id must be a whole number from 0 on, got -1'),
        ('1,1.5,2,3,4,5', 'line 2: the id must be a whole number from 0 on, got 1.5'),
        ('1,3,2,3,4,0', 'line 2: box width and height must be positive, got 4 x 0'),
        ('1,3,inf,3,4,5', 'line 2: box values must be finite numbers, got .inf'),
        ('1,2,2,3,4,5', 'line 2: every id must be there once in a frame, got id 2 again'),
    ],
)
def test_a_malformed_line_is_named(line: str, reason: str, tmp_path: Path) -> None:
    folder = write_mot(tmp_path / 'walk', ['1,2,2,3,4,5,1,1,1', line])
    with pytest.raises(SequenceError, match=f'gt.txt, {reason}'):
        MotSequence.load(folder)
    with pytest.raises(SequenceError, match=f'gt.txt, {reason}'):
        read_tracks(folder / 'gt/gt.txt', 'walk')


@pytest.mark.parametrize(
    ('info', 'reason'),
    [
        ('frameRate=30', 'cannot be used: File contains no section headers'),
        ('[Sequence]\nframeRate=fast', "frameRate in .* from 0.01 to 1000, got 'fast'"),
        ('[Sequence]\nframeRate=0', "frameRate in .* from 0.01 to 1000, got '0'"),
    ],
)
def test_a_malformed_seqinfo_is_refused(info: str, reason: str, tmp_path: Path) -> None:
    folder = write_mot(tmp_path / 'walk', ['1,2,2,3,4,5,1,1,1'], info)
    with pytest.raises(SequenceError, match=reason):
        MotSequence.load(folder)


def test_there_must_be_people(tmp_path: Path) -> None:
    folder = write_mot(tmp_path / 'walk', ['1,2,2,3,4,5,0,1,1'])
    with pytest.raises(SequenceError, match='has no box of a pedestrian'):
        MotSequence.load(folder)


def test_tracks_of_several_are_in_a_folder(tmp_path: Path) -> None:
    (tmp_path / 'one.txt').write_text('1,4,10,5,10,20,0.9,-1,-1,-1\n')
    (tmp_path / 'two_img1.txt').write_text('2,5,10,5,10,20,0.9,-1,-1,-1\n')
    assert read_tracks(tmp_path, 'one') == {1: {4: at(10)}}
    assert read_tracks(tmp_path, 'two') == {2: {5: at(10)}}
    with pytest.raises(FileNotFoundError, match=r'three\.txt'):
        read_tracks(tmp_path, 'three')

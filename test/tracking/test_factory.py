# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Who begins, with which first mask, and who is found again."""

from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from gait_segmentation.detector.detection import Detection
from gait_segmentation.detector.networks import DetectorConfig, Networks
from gait_segmentation.detector.scheduler import DetectorScheduler
from gait_segmentation.errors import InputError
from gait_segmentation.gait_model import default_bank
from gait_segmentation.geometry import Box
from gait_segmentation.heat_maps import HeatMap
from gait_segmentation.scene.scene import Scene, View
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.factory import estimate_first
from gait_segmentation.tracking.reidentification import recognized
from gait_segmentation.tracking.track import Track
from test.tracking.figures import (
    GREEN,
    RED,
    STEP_NS,
    WIDTH,
    Figure,
    Told,
    ids,
    picture,
    walk,
    watched,
)
from test.walkers import body, small_bank


def test_nobody_is_looked_for_once_boxes_are_given_until_a_reset() -> None:
    told = watched([Figure(200).box], 2)
    told.tracker.initialize(Box(500, 10, 20, 50))
    figures = Figure(60), Figure(200)
    with pytest.raises(InputError):
        told.show(*figures)
    # Not even by one that is refused.
    assert ids(told.show(*figures)) == [1, 0]
    told.start(Figure(60))
    for _ in range(3):
        told.show(*figures)
    told.tracker.reset()
    told.start(Figure(60))
    for _ in range(3):
        assert ids(told.show(*figures)) == [3, 0]
    told.tracker.reset()
    assert ids(told.show(*figures)) == [4, 0]


def test_a_box_starts_before_what_the_camera_has_seen() -> None:
    board, figure = (75, 125), Figure(60)
    image, (mask,) = picture([figure], boards=[board])
    box = Box.around(mask)

    def begun(frames: int) -> Track:
        told = Told()
        for _ in range(frames):
            told.show(boards=[board])
        told.tracker.initialize(Box(box.x, box.y, board[1] - box.x, box.height))
        told.tracker.update(image, told.stamp_ns)
        (track,) = told.tracker.tracks()
        return track

    tracks = [begun(number) for number in (0, 15)]
    # Half of the box is a board, which was there before.
    masks = [cv2.resize(track.mask.image, image.shape[1::-1]) for track in tracks]
    wrong = [np.count_nonzero((each > 127) != (mask > 0)) for each in masks]
    assert wrong[1] < 0.5 * wrong[0]
    # And the track knows the place from its first frame on.
    known = [np.mean(track.view.background.count > 0) for track in tracks]
    assert known[0] == 0 < 0.5 < known[1]


@pytest.mark.parametrize(
    ('score', 'seen', 'anew'),
    [(0.9, 10, True), (0.9, 6, False), (0.6, 10, False)],
)
def test_of_whom_more_is_seen_for_some_time_than_is_followed_begins_anew(
    score: float, seen: int, anew: bool
) -> None:
    figure = Figure(100)
    image, (mask,) = picture([figure])
    part = mask.copy()
    part[95:] = 0
    boxes: list[Box] = []
    config = DetectorConfig(calm_period=0.02, urgent_period=0.02)
    networks = Networks(lambda image: [Detection(box, score) for box in boxes])
    told = Told(scheduler=DetectorScheduler(config, networks))
    told.tracker.initialize(Box.around(part))
    results = []
    for each in (2 * [part], seen * [mask], [part], (10 - seen) * [mask]):
        for shown in each:
            boxes[:] = [Box.around(shown)]
            results += told.see(image, [part])
    assert ids(results) == len(results) * [1]
    (track,) = told.tracker.tracks()
    assert (track.body.iou(figure.box) > 0.8) == anew
    assert results[8].body.height < 0.7 * figure.height


def test_who_is_half_hidden_does_not_begin_anew_where_a_detector_sees_all_of_them() -> None:
    boxes: list[Box] = []
    told = watched(boxes)

    def show(*figures: Figure) -> Track | None:
        image, masks = picture(figures)
        # The right half of the place is behind a low wall.
        image[90:, WIDTH // 2 :] = 20
        seen = [mask.copy() for mask in masks]
        for mask in seen:
            mask[90:, WIDTH // 2 :] = 0
        told.see(image, seen, masks)
        return next(iter(told.tracker.tracks()), None)

    for _ in range(8):
        show()
    path = walk(Figure(100), 14, 8.0)
    told.start(path[0])
    tracks = []
    for figure in [*path, *(12 * path[-1:])]:
        boxes[:] = [figure.box]
        tracks.append(show(figure))
    assert tracks[-1].box.height < 0.6 * tracks[-1].body.height
    assert all(track is tracks[0] for track in tracks)


@pytest.mark.parametrize(('coat', 'track_id'), [(RED, 1), (GREEN, 2)])
def test_somebody_found_is_the_lost_one_only_in_the_same_clothes(
    coat: tuple[int, int, int], track_id: int
) -> None:
    boxes: list[Box] = []
    told = watched(boxes, 2, patience=5.0)
    for figure in walk(Figure(260), 25, 4.0):
        boxes[:] = [figure.box] if figure.x < 320 else []
        results = told.show(figure)
    boxes.clear()
    for _ in range(12):
        results = told.show()
    assert (results[0].state, results[0].track_id) == ('lost', 1)
    # Far from where the first has left.
    boxes[:] = [Figure(60, coat).box]
    results = told.show(Figure(60, coat))
    assert results[track_id - 1].state == 'tracked'
    assert results[track_id - 1].track_id == track_id


def test_the_slot_of_somebody_who_is_lost_waits_for_them() -> None:
    boxes: list[Box] = []
    told = watched(boxes, 1, patience=2.0)
    out = walk(Figure(260), 25, 4.0)
    for figure in out:
        boxes[:] = [figure.box] if figure.x < 320 else []
        told.show(figure)
    other = Figure(60, GREEN)
    boxes[:] = [other.box]
    said = [told.show(other)[0] for _ in range(70)]
    assert {(each.state, each.track_id) for each in said[:20]} == {('lost', 1)}
    assert (said[-1].state, said[-1].track_id) == ('tracked', 2)


@pytest.mark.parametrize(('coat', 'found'), [(RED, True), (GREEN, False)])
def test_a_lost_person_is_found_in_a_map_though_a_box_was_given(
    coat: tuple[int, int, int], found: bool
) -> None:
    told = Told(patience=10.0)
    told.follow(walk(Figure(60), 12))
    for _ in range(30):
        (result,) = told.show(boards=[(0, WIDTH)])
    assert result.state == 'lost'
    # Half as tall by now, where nothing else would look for them.
    figure = Figure(260, coat, y=120.0, height=55.0)
    states = []
    for _ in range(4):
        image, (mask,) = picture([figure])
        (result,) = told.tracker.update(image, told.stamp_ns, mask)
        told.frames += 1
        states.append((result.state, result.track_id))
    assert (('tracked', 1) in states) == found
    assert {track_id for _, track_id in states} == {1}


@pytest.mark.parametrize(
    ('alike', 'heights', 'reach', 'same'),
    [
        (0.6, 0.0, 0.5, True),
        (0.5, 0.0, 0.5, False),
        (0.7, 0.1, 0.5, True),
        (0.7, 0.5, 0.5, False),
        (0.9, 0.5, 0.5, True),
        (0.9, 4.0, 0.5, False),
        (0.9, 4.0, 4.0, True),
        (0.95, 1.0, 0.5, True),
        (0.95, 2.0, 0.5, False),
    ],
)
def test_who_can_hardly_have_come_so_far_must_look_the_more_alike(
    alike: float, heights: float, reach: float, same: bool
) -> None:
    box = Box(10, 10, 20, 50)
    lost = SimpleNamespace(reach=reach, similarity=lambda *_: alike, body=box, lost_s=0.0)
    view = SimpleNamespace(now=None, scale=0.5)
    start = SimpleNamespace(box=box.shifted(50 * heights, 0).scaled(0.5))
    assert recognized([lost], view, start) is (lost if same else None)


@pytest.mark.parametrize(
    ('taller', 'lost_s', 'same'),
    [
        (1.4, 0.0, True),
        (1.6, 0.0, False),
        (1.6, 0.5, True),
        (2.5, 1.0, False),
        (0.7, 0.0, True),
        (0.6, 0.0, False),
        (0.5, 1.0, True),
    ],
)
def test_who_is_of_another_height_at_once_is_somebody_else(
    taller: float, lost_s: float, same: bool
) -> None:
    box = Box(10, 10, 20, 50)
    lost = SimpleNamespace(reach=9.0, similarity=lambda *_: 1.0, body=box, lost_s=lost_s)
    view = SimpleNamespace(now=None, scale=0.5)
    start = SimpleNamespace(box=Box.from_center(20, 35, 20, 50 * taller).scaled(0.5))
    assert recognized([lost], view, start) is (lost if same else None)


def test_people_are_found_in_the_heat_map_of_a_frame_and_not_in_a_late_one() -> None:
    told, (image, _) = Told(), picture([])
    template, heat = small_bank().templates[0, 0], np.zeros(image.shape[:2], np.uint8)
    heat[40 : 40 + template.shape[0], 100 : 100 + template.shape[1]] = template
    image[heat > 127] = GREEN
    for number in range(1, 4):
        assert ids(told.tracker.update(image, number * STEP_NS)) == [0]
        # It comes when its frame is past.
        told.tracker.add_heat_map(heat, number * STEP_NS)
    assert ids(told.tracker.update(image, 4 * STEP_NS, heat)) == [1]


SOURCE = (240, 320)


@pytest.mark.parametrize(
    ('by_map', 'trust', 'legs', 'as_shown'),
    [
        (True, 1.0, 180, True),
        (False, 1.0, 180, True),
        (False, 1.0, 140, False),
        (True, 0.0, 180, False),
        (True, 0.4, 180, False),
    ],
    ids=['found in it', 'box filled', 'half of the box filled', 'not trusted', 'hardly trusted'],
)
def test_the_first_mask_is_as_a_map_shows_it_that_fills_the_box(
    by_map: bool, trust: float, legs: int, as_shown: bool
) -> None:
    # A black cabinet goes on from somebody in black who reaches across it.
    image = np.random.default_rng(0).integers(120, 250, (*SOURCE, 3), np.uint8)
    shown = np.zeros(SOURCE, np.uint8)
    shown[60:180, 100:160] = body((60, 120))
    shown[80:90, 130:165] = 255
    image[shown > 0] = 10
    image[95:200, 140:200] = 10
    box = Box(*cv2.boundingRect(shown))
    shown[legs:] = 0
    scene, view = Scene(SOURCE), View(SOURCE, 1.0)
    scene.advance(image, 1)
    scene.show(HeatMap(shown, 1, trust))
    scene.add(view)
    start = estimate_first(view, box, None, default_bank(), TrackingConfig(), by_map=by_map)
    truth = cv2.resize(shown, start.mask.shape[::-1], interpolation=cv2.INTER_AREA) > 127
    mask = start.mask > 0
    assert ((mask & truth).sum() > 0.98 * (mask | truth).sum()) == as_shown


def test_of_two_who_touch_in_a_map_the_first_mask_is_of_one() -> None:
    image, (one, other) = picture([Figure(120), Figure(148, GREEN)])
    scene, view = Scene(image.shape[:2]), View(image.shape[:2], 1.0)
    scene.advance(image, 1)
    scene.show(HeatMap(one | other, 1, 1.0))
    scene.add(view)
    bank, box = small_bank(), Figure(120).box
    start = estimate_first(view, box, None, bank, TrackingConfig(), by_map=True)
    assert start.mask[one > 0].mean() > 0.9 * 255
    assert start.mask[:, round(box.right) + 6 :].max() == 0
    # And the map stays as it is.
    assert view.heat.values[other > 0].min() > 0


def test_a_map_that_found_somebody_is_their_first_mask() -> None:
    told = Told()
    image, (own,) = picture([Figure(120)])
    faint = own.copy()
    faint[95:] //= 4
    told.tracker.add_heat_map(faint, told.stamp_ns)
    told.tracker.update(image, told.stamp_ns)
    [track] = told.tracker.tracks()
    assert track.mask.image[:90].any()
    assert not track.mask.image[100:].any()

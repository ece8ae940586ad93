# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Who is found by the walk, and which slot they get."""

from collections.abc import Sequence
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from gait_segmentation.errors import InputError
from gait_segmentation.gait_model import default_bank
from gait_segmentation.geometry import Box
from gait_segmentation.heat_maps import HeatMap
from gait_segmentation.results import LOST, TRACKED
from gait_segmentation.scene.scene import Scene, View
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.initialization import estimate_first, slot_for_found
from test.tracking.figures import (
    GREEN,
    RED,
    STEP_NS,
    WIDTH,
    Figure,
    Told,
    ids,
    picture,
    step,
    walk,
)
from test.walkers import body, small_bank

ON_TRIAL = 77
"""Frames until it is settled whether somebody found is a person."""


class Finder:
    """Finds whom it is told to, and remembers when it was asked."""

    def __init__(self) -> None:
        self.boxes: list[Box] = []
        self.asked: list[list[Box]] = []
        self.tried: list[Box] = []
        self.rejected: list[Box] = []
        self.wanted = True

    def update(
        self, scene: Scene, occupied: Sequence[Box], *, tried: Sequence[Box], wanted: bool
    ) -> list[Box]:
        self.asked.append(list(occupied))
        self.tried = list(tried)
        self.wanted = wanted
        found, self.boxes = self.boxes, []
        return found

    def evidence(self, box: Box) -> float:
        return 1.0

    def reject(self, box: Box) -> None:
        self.rejected.append(box)

    detector = None
    """Nothing is known of the place."""

    def find(self, figure: Figure) -> None:
        self.boxes.append(figure.box)

    def stop(self) -> None:
        """Have nothing to forget."""


@pytest.fixture
def finder(monkeypatch: pytest.MonkeyPatch) -> Finder:
    """Return the finder of all trackers that are made."""
    made = Finder()
    monkeypatch.setattr('gait_segmentation.starting.starter.WalkerFinder', lambda *_: made)
    return made


@pytest.mark.parametrize('slots', [1, 2])
def test_people_found_get_free_slots_and_are_told_to_the_finder(
    finder: Finder, slots: int
) -> None:
    told = Told(slots, 'walk')
    assert ids(told.show(Figure(60))) == [0] * slots
    finder.find(Figure(60))
    for figure in step([Figure(60)] * ON_TRIAL):
        assert ids(told.show(figure)) == [1, 0][:slots]
    finder.asked.clear()
    told.show(Figure(60))
    # Without a free slot nobody is looked for.
    assert len(finder.asked) == slots - 1
    for (occupied,) in finder.asked:
        assert occupied.iou(Figure(60).box) > 0.7


@pytest.mark.parametrize('fits', [False, True])
def test_who_was_found_leaves_the_slot_after_a_second_without_the_shape_of_a_body(
    finder: Finder, fits: bool
) -> None:
    told = Told(1, 'walk')
    figures = step(walk(Figure(60), 40))
    finder.find(figures[0])
    slots = []
    for number, figure in enumerate(figures):
        image, (mask,) = picture([figure])
        body = mask.copy()
        if not fits:
            body[: round(figure.y)] = 0
        slots += ids(told.see(image, [mask], [body]))
        if number == 10:
            # Until then it is looked at all the same.
            assert finder.asked[-1] == []
            (box,) = finder.tried
            assert box.iou(figure.box) > 0.4
    assert slots == ([1] * 40 if fits else [1] * 25 + [0] * 15)
    assert len(finder.rejected) == (0 if fits else 1)


def test_nobody_is_looked_for_once_boxes_are_given_until_a_reset(finder: Finder) -> None:
    told = Told(2, 'walk')
    told.tracker.initialize(Box(500, 10, 20, 50))
    with pytest.raises(InputError):
        told.show(Figure(60))
    # Not even by one that is refused.
    told.show(Figure(60))
    assert finder.wanted
    finder.asked.clear()
    told.start(Figure(60))
    told.show(Figure(60))
    assert finder.asked == [] or not finder.wanted
    finder.asked.clear()
    told.show(Figure(60))
    assert finder.asked == []
    told.tracker.reset()
    told.show(Figure(60))
    assert finder.wanted
    Told(2, 'none').show(Figure(60))
    assert not finder.wanted


@pytest.mark.parametrize('auto', ['none', 'walk'])
def test_a_box_starts_before_what_the_camera_has_seen(auto: str) -> None:
    board, figure = (75, 125), Figure(60)
    image, (mask,) = picture([figure], boards=[board])
    box = Box.around(mask)

    def first_mask(frames: int) -> np.ndarray:
        told = Told(1, auto)
        for _ in range(frames):
            told.show(boards=[board])
        told.tracker.initialize(Box(box.x, box.y, board[1] - box.x, box.height))
        told.tracker.update(image, told.stamp_ns)
        (track,) = told.tracker.tracks()
        return cv2.resize(track.mask.image, image.shape[1::-1])

    # Half of the box is a board, which was there before.
    wrong = [np.count_nonzero((first_mask(n) > 127) != (mask > 0)) for n in (0, 15)]
    assert wrong[1] < 0.5 * wrong[0]


@pytest.mark.parametrize(('coat', 'track_id'), [(RED, 1), (GREEN, 2)])
def test_somebody_found_is_the_lost_one_only_in_the_same_clothes(
    finder: Finder, coat: tuple[int, int, int], track_id: int
) -> None:
    told = Told(1, 'walk', patience=5.0)
    out = walk(Figure(260), 25, 4.0)
    finder.find(out[0])
    for figure in out:
        (result,) = told.show(figure)
    for _ in range(5):
        (result,) = told.show()
    assert (result.state, result.track_id) == ('lost', 1)
    # Far from where the first has left.
    finder.find(Figure(60, coat))
    (result,) = told.show(Figure(60, coat))
    assert (result.state, result.track_id) == ('tracked', track_id)


@pytest.mark.parametrize(('coat', 'found'), [(RED, True), (GREEN, False)])
def test_a_lost_person_is_found_in_a_map_though_a_box_was_given(
    coat: tuple[int, int, int], found: bool
) -> None:
    told = Told(1, 'none', patience=10.0)
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
    ('alike', 'heights', 'lost_s', 'same'),
    [
        (0.7, 0.5, 0.0, True),
        (0.6, 0.5, 0.0, False),
        (0.7, 4.0, 0.0, False),
        (0.7, 4.0, 0.5, True),
        (0.95, 4.0, 0.0, True),
        (0.95, 9.0, 0.0, False),
    ],
)
def test_who_can_hardly_have_come_so_far_must_look_the_more_alike(
    alike: float, heights: float, lost_s: float, same: bool
) -> None:
    box = Box(10, 10, 20, 50)
    lost = SimpleNamespace(
        state=LOST, lost_s=lost_s, similarity=lambda *_: alike, body=box, track_id=7
    )
    view = SimpleNamespace(now=None, scale=0.5)
    start = SimpleNamespace(box=box.shifted(50 * heights, 0).scaled(0.5))
    assert slot_for_found([lost], view, start) == (0, 7 if same else None)


def test_of_those_who_are_lost_the_one_lost_longest_makes_room() -> None:
    box = Box(10, 10, 20, 50)
    lost = [
        SimpleNamespace(state=LOST, lost_s=s, similarity=lambda *_: 0.0, body=box)
        for s in (1.0, 3.0, 2.0)
    ]
    seen = SimpleNamespace(state=TRACKED)
    view, start = SimpleNamespace(now=None, scale=1.0), SimpleNamespace(box=box)
    assert slot_for_found([seen, *lost], view, start) == (2, None)
    assert slot_for_found([*lost, None], view, start) == (3, None)
    assert slot_for_found([seen], view, start) is None


def test_people_are_found_in_the_heat_map_of_a_frame_and_not_in_a_late_one() -> None:
    told, (image, _) = Told(1, 'walk'), picture([])
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
    ],
    ids=['found in it', 'box filled', 'half of the box filled', 'not trusted'],
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
    scene.advance(image, 1, heat=HeatMap(shown, 1, trust))
    scene.add(view)
    start = estimate_first(view, box, None, default_bank(), TrackingConfig(), by_map=by_map)
    truth = cv2.resize(shown, start.mask.shape[::-1], interpolation=cv2.INTER_AREA) > 127
    mask = start.mask > 0
    assert ((mask & truth).sum() > 0.98 * (mask | truth).sum()) == as_shown


def test_a_map_that_found_somebody_is_their_first_mask() -> None:
    told = Told(auto='walk')
    image, (own,) = picture([Figure(120)])
    faint = own.copy()
    faint[95:] //= 4
    told.tracker.add_heat_map(faint, told.stamp_ns)
    told.tracker.update(image, told.stamp_ns)
    [track] = told.tracker.tracks()
    assert track.mask.image[:90].any()
    assert not track.mask.image[100:].any()

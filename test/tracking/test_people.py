# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Who gets which slot, and who is who when people touch."""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from functools import partial
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from gait_segmentation.detector.detection import Detection, SoftMask
from gait_segmentation.detector.networks import DetectorConfig, Networks
from gait_segmentation.detector.scheduler import Detections, DetectorScheduler
from gait_segmentation.geometry import Box
from gait_segmentation.scene.ego_motion import WorldMotion
from gait_segmentation.tracking.existence import Existence
from gait_segmentation.tracking.people import People
from gait_segmentation.tracking.tentative import Tentative
from gait_segmentation.tracking.track import Track
from test.tracking.figures import BLUE, GREEN, RED, Figure, Told, ids, picture, walk, watched

EVERY = DetectorConfig(calm_period=0.02, urgent_period=0.02)


def test_the_tallest_get_slots_first_and_the_others_when_one_is_free() -> None:
    boxes: list[Box] = []
    told = watched(boxes, 2, patience=0.2)
    people = [Figure(60, RED, height=70), Figure(160, BLUE, height=100), Figure(260, GREEN)]
    boxes[:] = [each.box for each in people]
    bodies = [each.body for each in told.show(*people)]
    assert [body.iou(people[k].box) > 0.5 for body, k in zip(bodies, (1, 2), strict=True)] == [
        True,
        True,
    ]
    boxes.pop()
    for _ in range(30):
        results = told.show(*people[:2])
    assert results[1].state == 'tracked'
    assert results[1].body.iou(people[0].box) > 0.5


@pytest.mark.parametrize(
    ('slots', 'height', 'takes'), [(2, 120, True), (2, 80, False), (1, 120, False)]
)
def test_who_is_much_taller_than_one_of_several_takes_that_slot(
    slots: int, height: float, takes: bool
) -> None:
    boxes: list[Box] = []
    told = watched(boxes, slots)
    people = [Figure(60, RED, height=50), Figure(160, BLUE, height=60)][:slots]
    boxes[:] = [each.box for each in people]
    for _ in range(5):
        told.show(*people)
    boxes.append(Figure(260, GREEN, height=height).box)
    for _ in range(5):
        results = told.show(*people, Figure(260, GREEN, height=height))
    bodies = [result.body for result in results]
    assert any(body.iou(boxes[-1]) > 0.5 for body in bodies) == takes
    # It is that of the smallest, and nobody else's changes.
    tallest = people[-1].box
    assert any(body.iou(tallest) > 0.5 for body in bodies)
    assert len(set(ids(results))) == slots


@pytest.mark.parametrize(('score', 'slot'), [(0.9, 0), (0.2, None)])
def test_only_who_is_taken_for_a_person_gets_a_free_slot(score: float, slot: int | None) -> None:
    track = Mock(slot=None, state='tracked', body=Box(0, 0, 20, 50))
    track.existence = Existence(1).seen(score, 0.4)
    track.publish = partial(setattr, track, 'slot')
    People(1, tracks=[track]).number(2)
    assert track.slot == slot


def test_two_who_touch_from_the_beginning_are_two() -> None:
    boxes: list[Box] = []
    told = watched(boxes, 2)
    for figure in walk(Figure(120, RED), 12, 2.0):
        other = Figure(figure.x + 24, BLUE)
        boxes[:] = [figure.box, other.box]
        results = told.show(figure, other)
    assert sorted(ids(results)) == [1, 2]
    for each in (figure, other):
        assert max(result.body.iou(each.box) for result in results) > 0.6


class Masks:
    """A network that draws for each known box the figure that is nearest to it."""

    def __init__(self, figures: list[Figure]) -> None:
        self.figures, self.asked = figures, list[Box]()

    def draw(self, image: np.ndarray, box: Box) -> SoftMask:
        self.asked.append(box)
        if not self.figures:
            return SoftMask(np.zeros((40, 40), np.uint8), 1.0, (-box.x, -box.y), box)
        nearest = max(self.figures, key=lambda figure: figure.box.iou(box))
        return SoftMask(nearest.mask(), 1.0, (0.0, 0.0), box.padded(20, 20))


def test_the_mask_of_one_person_is_evidence_for_them_alone() -> None:
    figures = [Figure(120, RED), Figure(140, RED)]
    networks = Networks(
        lambda image: [Detection(each.box, 0.9) for each in figures], Masks(figures)
    )
    told = Told(2, scheduler=DetectorScheduler(EVERY, networks))
    image, shown = picture(figures)
    results = told.tracker.update(image, told.stamp_ns)
    for result in results:
        own = max(range(2), key=lambda k: figures[k].box.iou(result.body))
        other = (shown[1 - own] > 0) & (figures[own].mask() == 0)
        assert (result.likelihood[other] > 127).mean() < 0.1
        assert (result.likelihood[shown[own] > 0] > 127).mean() > 0.8


def test_a_mask_of_who_comes_near_is_not_theirs() -> None:
    stays, comes = Figure(120, RED), Figure(160, RED)
    masks = Masks([stays])
    networks = Networks(lambda image: [], masks)
    told = Told(1, scheduler=DetectorScheduler(EVERY, networks))
    told.start(stays)
    for _ in range(4):
        told.show(stays)
    for shown in stays, comes:
        masks.figures[:] = [shown]
        told.show(stays, comes)
        (track,) = told.tracker.tracks()
        assert (track.drawn_now() is not None) == (shown is stays)


def test_a_mask_is_on_a_person_if_most_of_it_is_and_on_nobody_outside() -> None:
    figure = Figure(120)
    told = Told()
    told.start(figure)
    told.show(figure)
    (track,) = told.tracker.tracks()

    def is_on(*figures: Figure) -> bool:
        both = np.maximum.reduce([each.mask() for each in figures])
        return track.is_on(SoftMask(both, 1.0, (0.0, 0.0), Box(0, 0, 320, 180)))

    assert [is_on(figure), is_on(figure, Figure(160, height=80)), is_on(Figure(150))] == [1, 1, 0]
    track.shift(400, 0)
    assert track.is_outside
    assert not is_on(figure)


def test_who_is_new_is_drawn_before_who_is_known() -> None:
    figures = [Figure(60, RED)]
    masks = Masks(figures)

    def people(image: np.ndarray) -> list[Detection]:
        return [Detection(each.box, 0.8) for each in figures]

    told = Told(2, scheduler=DetectorScheduler(EVERY, Networks(people, masks)))
    told.show(*figures)
    assert masks.asked == [figures[0].box]
    figures.append(Figure(160, BLUE))
    told.show(*figures)
    new, known = masks.asked[1:]
    assert (new, known.iou(figures[0].box) > 0.5) == (figures[1].box, True)


class Late(DetectorScheduler):
    """Says so many frames later who was there."""

    def __init__(self, networks: Networks, frames: int) -> None:
        super().__init__(EVERY, networks)
        self._late: deque[Detections | None] = deque([None] * frames)

    def look(self, *asked: Any, **how: Any) -> Detections | None:
        self._late.append(super().look(*asked, **how))
        return self._late.popleft()


def test_who_is_found_late_begins_where_they_are_drawn_now() -> None:
    figures: list[Figure] = []
    networks = Networks(
        lambda image: [Detection(each.box, 0.9) for each in figures], Masks(figures)
    )
    told = Told(1, scheduler=Late(networks, 4))
    for figure in walk(Figure(60, RED), 5, 4.0):
        figures[:] = [figure]
        (result,) = told.show(figure)
    assert result.track_id == 1
    assert result.box.iou(figure.box) > 0.9


def test_who_has_left_when_a_look_comes_does_not_begin() -> None:
    figures = [Figure(60, RED)]
    networks = Networks(
        lambda image: [Detection(each.box, 0.9) for each in figures], Masks(figures)
    )
    told = Told(1, scheduler=Late(networks, 4))
    told.show(*figures)
    figures.clear()
    assert [told.show()[0].track_id for _ in range(6)] == [0] * 6


@pytest.mark.parametrize(
    ('frames', 'known', 'counts'), [(20, 1, True), (20, 70, True), (30, 1, False)]
)
def test_a_look_that_comes_more_than_a_second_late_says_nothing(
    frames: int, known: int, counts: bool
) -> None:
    seen = [Detection(Figure(60).box, 0.9)]
    told = Told(scheduler=Late(Networks(lambda image: seen), frames))
    told.follow([Figure(60)] * known)
    seen.clear()
    for _ in range(frames + 1):
        told.show(Figure(60))
    (track,) = told.tracker.tracks()
    assert bool(track.existence.missed) == counts


def test_where_somebody_was_in_the_frame_of_a_late_look_is_known() -> None:
    told, path = Told(working_height=60), walk(Figure(60), 14, 4.0)
    results = told.follow(path)
    (track,) = told.tracker.tracks()
    assert track.view.scale < 0.7
    for back in (0, 1, 8):
        boxes = track.boxes_at(results[-1 - back].stamp_ns)
        assert [each.center_x for each in boxes] == [pytest.approx(path[-1 - back].x, abs=3)] * 2
    # And what was seen then goes along with them.
    track.see(Detection(path[-9].box, 0.9), results[-9].stamp_ns)
    seen = track.detected_in(results[-1].stamp_ns)
    assert seen.center_x == pytest.approx(path[-1].x, abs=3)


def test_a_box_that_is_given_begins_with_the_mask_of_who_is_in_it() -> None:
    figure = Figure(120, RED)
    networks = Networks(lambda image: [], Masks([figure]))
    told = Told(1, scheduler=DetectorScheduler(EVERY, networks))
    # A board in their colours goes on from them.
    image, (own,) = picture([figure])
    board = np.zeros_like(own)
    board[60:120, 125:150] = 255
    image[(board > 0) & (own == 0)] = RED
    told.tracker.initialize(figure.box.union(Box(125, 60, 15, 60)))
    (result,) = told.tracker.update(image, told.stamp_ns)
    beside = (board > 0) & (own == 0)
    assert (result.likelihood[beside] > 127).mean() < 0.1
    assert (result.likelihood[own > 0] > 127).mean() > 0.9


@pytest.mark.parametrize(('coat', 'follows'), [(RED, True), (GREEN, False)])
def test_a_track_that_looks_do_not_see_goes_over_to_who_looks_like_it(coat, follows) -> None:
    figure, boxes = Figure(60, RED), []
    told = watched(boxes, patience=5.0, period=0.1)
    told.start(figure)
    for _ in range(20):
        boxes[:] = [figure.box]
        told.show(figure)
    # What was taken for them stays where they were.
    other = Figure(170, coat)
    boxes[:] = [other.box]
    # Before it is lost.
    for _ in range(4):
        (result,) = told.show(figure, other)
    assert result.track_id == 1
    assert (result.state == 'tracked' and result.box.iou(other.box) > 0.5) == follows
    # Nobody is left who has the slot as well.
    assert ids(told.tracker._people.tracks) == [1]


def test_who_has_stood_there_from_the_beginning_is_no_part_of_the_place() -> None:
    known, stands = Figure(90, RED), Figure(150, BLUE)
    seen = [known]
    networks = Networks(
        lambda image: [Detection(each.box, 0.9) for each in seen], Masks([known, stands])
    )
    told = Told(2, scheduler=DetectorScheduler(EVERY, networks))
    image, masks = picture([known, stands])
    for _ in range(20):
        told.see(image, masks[:1])
    seen.append(stands)
    for _ in range(4):
        results = told.see(image, masks)
    likely = results[1].likelihood > 127
    assert likely[masks[1] > 0].mean() > 0.8


def test_those_with_a_slot_come_first_in_a_view_in_their_order() -> None:
    view = object()
    tracks = [
        SimpleNamespace(view=each, slot=slot)
        for each, slot in ((view, None), (view, 2), (object(), 1), (view, 0))
    ]
    assert [each.slot for each in People(3, tracks).seen_in(view)] == [0, 2, None]


@pytest.mark.parametrize(('height', 'near'), [(40, False), (60, True), (190, True), (210, False)])
def test_only_who_is_about_as_tall_is_followed_beside_somebody(height: float, near: bool) -> None:
    told = Told(working_height=50)
    told.start(Figure(120))
    told.show(Figure(120))
    [track] = told.tracker.tracks()
    assert track.view.scale < 0.6
    beside = Box.from_center(165, 90, 0.3 * height, height * track.body.height / 100)
    found = told.tracker._people.near(beside, by_map=False)
    assert found is (track if near else None)


def test_what_was_no_person_is_known_where_the_world_has_moved_it() -> None:
    thing = Tentative(Detection(Box(5, 5, 20, 50), 0.9), 5, Existence(5), rejected=True)
    people = People(1, tentative=[thing])
    motion = WorldMotion(np.array([[1, 0, 6], [0, 1, -2], [0, 0, 1.0]]))
    scene = Mock(views=[Mock(scale=0.5, now=Mock(motion=motion))], stamp_ns=9, source=(180, 320))
    people.follow([], 9, [], scene, lambda box: False)
    (moved,) = people.tentative
    assert moved == replace(thing, detection=Detection(Box(17, 1, 20, 50), 0.9))


def test_a_map_may_show_again_only_whom_it_can_give_a_slot_back() -> None:
    boxes = [Box(100 * number, 10, 40, 100) for number in range(3)]
    tracks = [
        Mock(body=box, state=state, slot=slot)
        for box, state, slot in zip(boxes, ('lost', 'lost', 'tracked'), (0, None, 1), strict=True)
    ]
    assert People(2, tracks).bodies == (boxes[1:], boxes[:1])


def test_the_free_slot_goes_to_who_is_tallest_in_the_image_whatever_the_view() -> None:
    small, tall = (
        Mock(slot=None, state='tracked', body=Box(0, 0, 10, height), pose=Mock(height=working))
        for height, working in ((60, 120), (90, 45))
    )
    for each in small, tall:
        each.existence.is_person.return_value = True
        each.publish.side_effect = partial(setattr, each, 'slot')
    People(1, [small, tall]).number(5)
    assert (small.slot, tall.slot) == (None, 0)


@pytest.mark.parametrize(('slot', 'room'), [(None, True), (0, False)])
def test_there_is_room_while_a_slot_is_free_whoever_is_followed_without_one(slot, room) -> None:
    people = People(1, [Mock(slot=slot, body=Box(0, 0, 40, 100))])
    assert people.has_small(50.0, others=True) == room


@pytest.mark.parametrize('slots', [1, 2])
def test_while_there_is_room_it_is_unsure_who_may_begin_the_likeliest_first(slots) -> None:
    def waiting(left: float, score: float, **options) -> Tentative:
        existence = Existence(1).seen(score, 0.1)
        return Tentative(Detection(Box(left, 0, 20, 50), score), 1, existence, **options)

    tentative = [
        waiting(0, 0.3),
        waiting(50, 0.5),
        waiting(90, 0.15),
        waiting(130, 0.4, rejected=True),
    ]
    people = People(slots, [Mock(slot=0)], tentative)
    assert [box.x for box in people.unsure(1)] == ([] if slots == 1 else [50, 0])


@pytest.mark.parametrize(
    ('changed', 'same'),
    [
        ({}, True),
        ({'likeness': 0.8}, False),
        ({'began_s': 3.0}, False),
        ({'height': 40}, False),
        ({'slot': 1}, False),
        ({'state': 'lost'}, False),
    ],
    ids=['alike', 'otherwise', 'there before', 'of another height', 'with a slot', 'lost'],
)
def test_who_lost_their_track_to_a_passer_has_it_again(
    changed: dict[str, Any], same: bool
) -> None:
    about = {'likeness': 0.9, 'began_s': 3.5, 'height': 100, 'slot': None, 'state': 'tracked'}
    about |= changed
    body, view = Box(50, 10, 40, 100), object()
    lost = Mock(track_id=1, slot=0, state='lost', lost_s=1.0, body=body, view=view, reach=6.5)
    lost.usual_ns = 3_500_000_000
    lost.likeness.return_value = about['likeness']
    other = Mock(track_id=2, slot=about['slot'], state=about['state'], view=view)
    other.existence = Existence(round(1e9 * about['began_s']))
    other.body = Box(110, 10, 40, about['height'])
    other.succeed = partial(Track.succeed, other)
    people = People(2, [lost, other])
    people.reunite()
    assert (people.tracks == [other]) == same
    assert (other.track_id, other.slot) == ((1, 0) if same else (2, about['slot']))

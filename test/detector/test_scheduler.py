# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import threading

import numpy as np
import pytest

from gait_segmentation.detector import scheduler as module
from gait_segmentation.detector.detection import Detection, SoftMask
from gait_segmentation.detector.networks import DetectorConfig, Networks
from gait_segmentation.detector.scheduler import DetectorScheduler
from gait_segmentation.errors import DetectorError
from gait_segmentation.geometry import Box

IMAGE = np.zeros((4, 4, 3), np.uint8)
SOMEBODY = Detection(Box(1, 1, 2, 2), 0.9)
MASK = SoftMask(np.zeros((2, 2), np.uint8), 1.0, (0.0, 0.0), Box(0, 0, 2, 2))
DETECTOR = Networks(lambda image: [SOMEBODY])


class Masks:
    """Draws the same of everybody, and remembers who that was."""

    def __init__(self):
        self.drawn = []

    def draw(self, image, box):
        self.drawn.append(box)
        return MASK


def looks(scheduler, period_ms=40, frames=50, **asked):
    """Return by the number of the frame what is seen in lockstep."""
    seen = {}
    for number in range(frames):
        stamp_ns = (number + 1) * period_ms * 10**6
        found = scheduler.look(IMAGE, stamp_ns, **asked)
        if found is not None:
            assert found.stamp_ns == stamp_ns
            seen[number] = found
    return seen


@pytest.mark.parametrize(
    ('urgent', 'period_ms', 'numbers'),
    [(False, 40, [0, 10, 20]), (True, 40, [0, 3, 6]), (True, 500, [0, 1, 2])],
)
def test_looks_are_more_frequent_while_somebody_is_missing(urgent, period_ms, numbers):
    seen = looks(DetectorScheduler(networks=DETECTOR), period_ms, urgent=urgent)
    assert list(seen)[:3] == numbers
    assert all(each.people == (SOMEBODY,) for each in seen.values())
    often = DetectorConfig(calm_period=0.0, urgent_period=0.0)
    assert len(looks(DetectorScheduler(often, DETECTOR), urgent=urgent)) == 50
    assert not looks(DetectorScheduler(networks=DETECTOR), boxes=False, urgent=urgent)


def test_frames_that_come_a_little_early_are_looked_at():
    scheduler, numbers = DetectorScheduler(networks=DETECTOR), []
    for number in range(10):
        early_ns = 0 if number == 0 else 10**6
        if scheduler.look(IMAGE, 10**9 + round(number * 1e9 / 30) - early_ns, urgent=True):
            numbers.append(number)
    assert numbers == [0, 3, 6, 9]


@pytest.mark.parametrize('urgent', [False, True])
def test_while_small_people_are_asked_for_it_looks_closer_now_and_then(urgent):
    child = Detection(Box(1, 1, 1, 1), 0.6)
    networks = DETECTOR._replace(closely=lambda image: [SOMEBODY, child], least_share=0.25)
    seen = looks(DetectorScheduler(networks=networks), small=True, urgent=urgent)
    close = [number for number, each in seen.items() if child in each.people]
    assert close[:3] == ([0, 21, 42] if urgent else [0, 20, 40])
    for number, each in seen.items():
        assert SOMEBODY in each.people
        # Who is smaller may be there though they were not seen.
        assert each.least_share == (0 if number in close else 0.25)
    scheduler = DetectorScheduler(networks=networks)
    assert all(child not in each.people for each in looks(scheduler, urgent=urgent).values())


@pytest.mark.parametrize('threaded', [False, True])
def test_each_look_looks_closely_where_it_is_not_known_if_somebody_is(threaded):
    asked, child = [], Detection(Box(2, 2, 1, 1), 0.6)

    def about(image, box):
        asked.append(box)
        return [child] if box == child.box else [Detection(SOMEBODY.box, 0.2)]

    networks = DETECTOR._replace(about=about)
    scheduler = DetectorScheduler(networks=networks, threaded=threaded)
    boxes = [child.box, SOMEBODY.box, Box(0, 0, 1, 1)]
    seen = None
    while seen is None:
        seen = scheduler.look(IMAGE, 1, urgent=True, unsure=boxes)
        if threaded and scheduler._running is not None:
            scheduler._running.result()
    assert (seen.people, asked) == ((SOMEBODY, child), boxes[:2])


def test_a_map_is_made_of_every_frame():
    red = DETECTOR._replace(heat_map=lambda image: image[..., 2])
    seen = looks(DetectorScheduler(networks=red), boxes=False, urgent=False)
    assert list(seen) == list(range(50))
    assert all(each.heat_map.shape == (4, 4) and each.people is None for each in seen.values())


@pytest.mark.parametrize('threaded', [False, True])
@pytest.mark.parametrize(('rate', 'people'), [(25.0, 1), (12.5, 1), (25.0, 2), (10.0, 4)])
def test_only_so_many_masks_are_drawn_in_a_second_those_first_who_need_one(rate, people, threaded):
    masks, boxes = Masks(), [Box(1, 1, 2, 3 + k) for k in range(people)]
    config = DetectorConfig(mask_rate=rate)
    scheduler = DetectorScheduler(config, DETECTOR._replace(masks=masks), threaded=threaded)
    numbers = []
    for number in range(50):
        drawn = scheduler.draw(IMAGE, (number + 1) * 40_000_000, boxes)
        assert masks.drawn[sum(numbers) :] == boxes[: len(drawn)]
        numbers.append(len(drawn))
    # Those of one image may be drawn ahead.
    assert numbers[0] == people
    assert 0 <= sum(numbers) - rate * 49 * 0.04 <= 5


@pytest.mark.parametrize(
    ('pace', 'looked', 'drawn'), [(1.0, 10, 100), (0.5, 10, 50), (0.25, 5, 25)]
)
def test_on_a_busy_computer_masks_get_rarer_and_then_looks(pace, looked, drawn):
    scheduler = DetectorScheduler(
        DetectorConfig(mask_rate=25.0), DETECTOR._replace(masks=(masks := Masks()))
    )
    scheduler.pace = pace
    assert len(looks(scheduler, frames=100, urgent=False)) == looked
    for number in range(100):
        scheduler.draw(IMAGE, (number + 1) * 40_000_000, [SOMEBODY.box])
    # Some may be drawn ahead.
    assert drawn <= len(masks.drawn) <= drawn + 5


def test_who_has_to_be_drawn_is_and_others_wait_for_it():
    scheduler = DetectorScheduler(DetectorConfig(mask_rate=25), DETECTOR._replace(masks=Masks()))
    frame = 40_000_000
    assert len(scheduler.draw(IMAGE, frame, [SOMEBODY.box] * 9)) == 5
    assert len(scheduler.draw(IMAGE, frame, [SOMEBODY.box] * 3, always=True)) == 3
    numbers = [len(scheduler.draw(IMAGE, k * frame, [SOMEBODY.box])) for k in range(2, 8)]
    assert numbers == [0, 0, 0, 1, 1, 1]
    # Time in which nobody was drawn is not made up for.
    assert len(scheduler.draw(IMAGE, 100 * frame, [SOMEBODY.box] * 9)) == 5


@pytest.mark.parametrize('network', ['boxes', 'none'])
def test_what_does_not_draw_draws_nobody(network):
    scheduler = DetectorScheduler(DetectorConfig(network=network))
    assert scheduler.draw(IMAGE, 10**9, [SOMEBODY.box]) == []


def test_no_network_looks_at_nothing(monkeypatch):
    monkeypatch.setattr(module, 'open_networks', lambda *_: pytest.fail('it was loaded'))
    assert not looks(DetectorScheduler(DetectorConfig(network='none')), urgent=True)


def test_after_a_reset_the_next_frame_is_looked_at_whatever_its_stamp():
    scheduler = DetectorScheduler(networks=DETECTOR._replace(masks=Masks()))
    assert scheduler.look(IMAGE, 10**9, urgent=False) is not None
    assert scheduler.look(IMAGE, 10**9 + 1, urgent=False) is None
    assert len(scheduler.draw(IMAGE, 10**9, [SOMEBODY.box] * 9)) == 5
    scheduler.reset()
    assert scheduler.look(IMAGE, 1, urgent=False) is not None
    assert len(scheduler.draw(IMAGE, 1, [SOMEBODY.box] * 9)) == 5


def done(scheduler):
    """Wait for what the thread does."""
    for pool in scheduler.pools:
        pool.submit(int).result(30)


def test_no_frame_waits_for_a_thread_of_its_own():
    go = threading.Event()

    def slow(image):
        assert go.wait(30)
        return [SOMEBODY]

    scheduler = DetectorScheduler(networks=Networks(slow), threaded=True)
    assert scheduler.look(IMAGE, 10**9, urgent=True) is None
    assert scheduler.look(IMAGE, 2 * 10**9, urgent=True) is None
    go.set()
    done(scheduler)
    seen = scheduler.look(IMAGE, 3 * 10**9, urgent=False)
    assert (seen.stamp_ns, seen.people) == (10**9, (SOMEBODY,))


def test_what_cannot_be_loaded_is_said_once_by_a_thread_and_always_in_lockstep():
    config = DetectorConfig(network='text.txt')
    for second in (2, 3):
        with pytest.raises(DetectorError, match=r'FILE\.onnx'):
            DetectorScheduler(config).look(IMAGE, second * 10**9, urgent=True)
    scheduler = DetectorScheduler(config, threaded=True)
    said = []
    for second in range(1, 5):
        said.append(scheduler.look(IMAGE, second * 10**9, urgent=True))
        done(scheduler)
    assert [each and each.people for each in said] == [None] * 4
    assert ['FILE.onnx' in each.error for each in said if each is not None] == [True]
    assert 'FILE.onnx' in scheduler.newest.error
    scheduler.reset()
    for second in (1, 2):
        scheduler.look(IMAGE, second * 10**9, urgent=True)
        done(scheduler)
    assert scheduler.newest is not None
    assert 'FILE.onnx' in scheduler.newest.error


def test_a_look_that_fails_in_a_thread_is_not_the_last():
    fails = [DetectorError('no such layer')]

    def look(image):
        if fails:
            raise fails.pop()
        return [SOMEBODY]

    scheduler, seen = DetectorScheduler(networks=Networks(look), threaded=True), []
    for second in range(1, 4):
        seen.append(scheduler.look(IMAGE, second * 10**9, urgent=True))
        done(scheduler)
    assert [(each.error, each.people) for each in seen[1:]] == [
        ('no such layer', None),
        ('', (SOMEBODY,)),
    ]


def test_networks_are_loaded_once_before_the_first_look_if_they_can_be(monkeypatch):
    loaded = []
    monkeypatch.setattr(module, 'open_networks', lambda *asked: loaded.append(asked) or DETECTOR)
    scheduler = DetectorScheduler(DetectorConfig(network='boxes'))
    assert scheduler.load() == ''
    assert loaded == [('boxes', -1)]
    assert looks(scheduler, urgent=True)[0].people == (SOMEBODY,)
    assert scheduler.draw(IMAGE, 10**9, [SOMEBODY.box]) == []
    assert len(loaded) == 1
    monkeypatch.undo()
    missing = DetectorScheduler(DetectorConfig(network='none.onnx'))
    assert 'none.onnx cannot be loaded' in missing.load()
    with pytest.raises(DetectorError, match=r'none\.onnx cannot be loaded'):
        missing.look(IMAGE, 10**9, urgent=True)

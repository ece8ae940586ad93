# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import threading

import numpy as np
import pytest

from gait_segmentation.detector import lookout as module
from gait_segmentation.detector.lookout import Lookout
from gait_segmentation.detector.networks import DetectorConfig, Networks
from gait_segmentation.detector.person_detector import Detection
from gait_segmentation.errors import DetectorError
from gait_segmentation.geometry import Box

IMAGE = np.zeros((4, 4, 3), np.uint8)
SOMEBODY = Detection(Box(1, 1, 2, 2), 0.9)
DETECTOR = Networks(lambda image: [SOMEBODY])


class Mapper:
    """Maps that say how many images it has seen, and how many people in the last one."""

    def __init__(self, needs_people):
        self.needs_people, self.images = needs_people, 0

    def reset(self):
        self.images = 0

    def draw(self, image, people):
        self.images += 1
        return np.array([[self.images, -1 if people is None else len(people)]])


def looks(lookout, period_ms=40, frames=50, **asked):
    """Return by the number of the frame what is seen in lockstep."""
    seen = {}
    for number in range(frames):
        stamp_ns = (number + 1) * period_ms * 10**6
        found = lookout.look(IMAGE, stamp_ns, **asked)
        if found is not None:
            assert found.stamp_ns == stamp_ns
            seen[number] = found
    return seen


@pytest.mark.parametrize(
    ('urgent', 'period_ms', 'numbers'),
    [(False, 40, [0, 10, 20]), (True, 40, [0, 3, 6]), (True, 500, [0, 1, 2])],
)
def test_looks_are_more_frequent_while_somebody_is_missing(urgent, period_ms, numbers):
    seen = looks(Lookout(networks=DETECTOR), period_ms, urgent=urgent)
    assert list(seen)[:3] == numbers
    assert all(each.people == (SOMEBODY,) for each in seen.values())
    often = DetectorConfig(calm_period=0.0, urgent_period=0.0)
    assert len(looks(Lookout(often, DETECTOR), urgent=urgent)) == 50
    assert not looks(Lookout(networks=DETECTOR), boxes=False, urgent=urgent)


def test_a_map_is_made_of_every_frame_with_the_people_that_it_needs():
    for needed in (True, False):
        lookout = Lookout(networks=Networks(DETECTOR.people, Mapper(needed)))
        seen = looks(lookout, boxes=False, urgent=False)
        images, people = np.concatenate([each.heat_map for each in seen.values()]).T
        assert list(images) == list(range(1, 51))
        at = [0, 3, 6, 9] if needed else []
        assert list(np.flatnonzero(people[:10] == 1)) == at
        assert [n for n, each in seen.items() if each.people is not None][: len(at)] == at
        lookout.reset()
        assert lookout.look(IMAGE, 1, boxes=False, urgent=False).heat_map[0, 0] == 1


def test_after_a_reset_the_next_frame_is_looked_at_whatever_its_stamp():
    lookout = Lookout(networks=DETECTOR)
    assert lookout.look(IMAGE, 10**9, urgent=False) is not None
    assert lookout.look(IMAGE, 10**9 + 1, urgent=False) is None
    lookout.reset()
    assert lookout.look(IMAGE, 1, urgent=False) is not None


def done(lookout):
    """Wait for what the thread does."""
    for pool in lookout.pools:
        pool.submit(int).result(30)


def test_no_frame_waits_for_a_thread_of_its_own():
    go = threading.Event()

    def slow(image):
        assert go.wait(30)
        return [SOMEBODY]

    lookout = Lookout(networks=Networks(slow), threaded=True)
    assert lookout.look(IMAGE, 10**9, urgent=True) is None
    assert lookout.look(IMAGE, 2 * 10**9, urgent=True) is None
    go.set()
    done(lookout)
    seen = lookout.look(IMAGE, 3 * 10**9, urgent=False)
    assert (seen.stamp_ns, seen.people) == (10**9, (SOMEBODY,))


def test_what_cannot_be_loaded_is_said_once_by_a_thread_and_always_in_lockstep():
    config = DetectorConfig(network='text.txt')
    for second in (2, 3):
        with pytest.raises(DetectorError, match=r'FILE\.onnx'):
            Lookout(config).look(IMAGE, second * 10**9, urgent=True)
    lookout = Lookout(config, threaded=True)
    said = []
    for second in range(1, 5):
        said.append(lookout.look(IMAGE, second * 10**9, urgent=True))
        done(lookout)
    assert [each and each.people for each in said] == [None] * 4
    assert ['FILE.onnx' in each.error for each in said if each is not None] == [True]
    assert 'FILE.onnx' in lookout.newest.error


def test_in_a_thread_people_are_told_before_they_are_drawn():
    lookout = Lookout(networks=Networks(DETECTOR.people, Mapper(True)), threaded=True)
    said = []
    for number in range(6):
        said.append(lookout.look(IMAGE, (2 + number) * 40_000_000, urgent=True))
        done(lookout)
    assert said[0] is None
    assert [each.people is not None for each in said[1:]] == [True, False, False, True, False]
    assert [each.heat_map is None for each in said[1:]] == [True, False, False, True, False]
    # The first image is drawn with who was seen in the one before.
    assert [int(each.heat_map[0, 1]) for each in said[2:4]] == [1, -1]
    assert lookout.newest.people == (SOMEBODY,)


def test_a_network_loaded_at_the_first_look_draws_whom_it_sees_then(monkeypatch):
    made = Networks(DETECTOR.people, Mapper(True))
    monkeypatch.setattr(module, 'open_networks', lambda name: made)
    seen = looks(Lookout(DetectorConfig(network='people')), boxes=False, urgent=False)
    assert (seen[0].people, seen[0].heat_map[0, 1]) == ((SOMEBODY,), 1)

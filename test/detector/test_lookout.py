# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import threading

import numpy as np

from gait_segmentation.detector.lookout import Lookout
from gait_segmentation.detector.person_detector import Detection
from gait_segmentation.geometry import Box

IMAGE = np.zeros((4, 4, 3), np.uint8)
SOMEBODY = Detection(Box(1, 1, 2, 2), 0.9)


def looks(urgent, period_ms=40, frames=50):
    """Return the numbers of the frames that are looked at in lockstep."""
    lookout, seen = Lookout(lambda image: [SOMEBODY]), []
    for number in range(frames):
        stamp_ns = (number + 1) * period_ms * 10**6
        found = lookout.look(IMAGE, stamp_ns, urgent=urgent)
        if found is not None:
            assert (found.stamp_ns, found.people) == (stamp_ns, (SOMEBODY,))
            seen.append(number)
    return seen


def test_looks_are_more_frequent_while_somebody_is_missing():
    assert looks(False)[:4] == [0, 10, 20, 30]
    assert looks(True)[:4] == [0, 3, 6, 9]
    assert looks(True, period_ms=500)[:3] == [0, 1, 2]


def test_after_a_reset_the_next_frame_is_looked_at_whatever_its_stamp():
    lookout = Lookout(lambda image: [])
    assert lookout.look(IMAGE, 10**9, urgent=False) is not None
    assert lookout.look(IMAGE, 10**9 + 1, urgent=False) is None
    lookout.reset()
    assert lookout.look(IMAGE, 1, urgent=False) is not None


def test_no_frame_waits_for_a_thread_of_its_own():
    go, done = threading.Event(), threading.Event()

    def slow(image):
        assert go.wait(30)
        return [SOMEBODY]

    lookout = Lookout(slow, threaded=True)
    assert lookout.look(IMAGE, 10**9, urgent=True) is None
    assert lookout.look(IMAGE, 2 * 10**9, urgent=True) is None
    lookout.pool.submit(done.set)
    go.set()
    assert done.wait(30)
    seen = lookout.look(IMAGE, 3 * 10**9, urgent=False)
    assert (seen.stamp_ns, seen.people) == (10**9, (SOMEBODY,))

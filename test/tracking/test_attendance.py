# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import pytest

from gait_segmentation.detector.lookout import Lookout, Sighting
from gait_segmentation.detector.networks import Networks
from gait_segmentation.detector.person_detector import Detection
from gait_segmentation.geometry import Box
from gait_segmentation.tracking.attendance import Attendance
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.slots import Slots
from test.tracking.figures import Figure, Told, picture, walk
from test.walkers import small_bank

BOX = Box(10, 10, 40, 100)
HERE = (Detection(BOX.shifted(5, 5), 0.4),)
ELSEWHERE = (Detection(BOX.shifted(100, 0), 0.9),)


def misses_until_doubted(*sightings):
    attendance = Attendance()
    for each in sightings:
        attendance.add(each, [BOX])
        assert not attendance.is_doubted
    for count in range(1, 1000):
        attendance.add(ELSEWHERE, [BOX])
        if attendance.is_doubted:
            attendance.add(HERE, [BOX])
            assert not attendance.is_doubted
            return count
    return 0


def test_silence_says_the_more_the_more_reliably_somebody_was_seen_before():
    always, often = [HERE] * 12, [HERE, HERE, ELSEWHERE] * 4
    rarely = [HERE, ELSEWHERE, ELSEWHERE, ELSEWHERE] * 3
    assert misses_until_doubted(*always) <= 3
    assert 3 < misses_until_doubted(*often) < misses_until_doubted(*rarely)


def test_somebody_lost_is_not_whatever_is_a_little_like_a_person():
    attendance = Attendance()
    for each in [HERE] * 12 + [ELSEWHERE] * 6:
        attendance.add(each, [BOX])
    attendance.add(HERE, [BOX], lost=True)
    assert attendance.is_doubted
    attendance.add((Detection(BOX, 0.9),), [BOX], lost=True)
    assert not attendance.is_doubted


class Network:
    """A detector that sees what it is told to."""

    def __init__(self):
        self.boxes = []

    def __call__(self, image):
        return [Detection(box, 0.9) for box in self.boxes]


def told(slots=1):
    network = Network()
    return Told(slots, 'detector', lookout=Lookout(networks=Networks(network))), network


def test_who_is_seen_is_tracked_and_followed():
    track, network = told()
    for number, figure in enumerate(walk(Figure(60), 20)):
        network.boxes = [figure.box]
        (result,) = track.show(figure)
        assert result.state == 'tracked', number
        assert result.body.iou(figure.box) > 0.5


@pytest.mark.parametrize('given', [True, False])
def test_who_is_not_seen_any_more_is_gone_though_the_place_looks_like_them(given):
    track, network = told()
    figure = Figure(100)
    if given:
        track.start(figure)
    network.boxes = [figure.box]
    for _ in range(60):
        (result,) = track.show(figure)
    assert result.state == 'tracked'
    network.boxes = []
    states = [track.show(figure)[0] for _ in range(30)]
    assert states[-1].state != 'tracked'
    assert 'detector' in states[-1].reason
    network.boxes = [figure.box]
    for _ in range(10):
        (result,) = track.show(figure)
    assert (result.state, result.track_id) == ('tracked', 1)


def test_whoever_gives_boxes_gives_all():
    track, network = told(2)
    track.start(Figure(60))
    network.boxes = [Figure(60).box, Figure(200).box]
    for _ in range(10):
        results = track.show(Figure(60), Figure(200))
    assert [each.state for each in results] == ['tracked', 'empty']


def test_after_a_reset_people_are_found_again_though_boxes_were_given():
    track, network = told()
    track.start(Figure(60))
    track.show(Figure(60))
    track.tracker.reset()
    network.boxes = [Figure(60).box]
    assert [track.show(Figure(60))[0].state for _ in range(3)][-1] == 'tracked'


def test_without_a_detector_nothing_is_asked():
    lookout = Lookout(networks=Networks(lambda image: pytest.fail('it was')))
    track = Told(1, 'walk', lookout=lookout)
    for _ in range(3):
        track.see(*picture([]))


class Late(Lookout):
    """Says so many frames later what was there."""

    def __init__(self, frames):
        super().__init__(networks=Networks(lambda image: []))
        self._frames, self._seen = frames, []

    def see(self, figure, stamp_ns):
        self._seen.append(Sighting(stamp_ns, (Detection(figure.box, 0.9),)))

    def look(self, image, stamp_ns, *, boxes=True, urgent):
        return self._seen[-1 - self._frames] if len(self._seen) > self._frames else None


@pytest.mark.parametrize(('frames', 'found'), [(0, True), (8, True), (20, False)])
def test_what_is_said_late_is_of_where_people_were_then(frames, found):
    lookout = Late(frames)
    track = Told(2, 'detector', lookout=lookout)
    for figure in walk(Figure(60), 60):
        lookout.see(figure, track.stamp_ns)
        results = track.show(figure)
        if frames and not track.tracker.tracks():
            # Whoever is found late is where they were; here they are told.
            track.start(figure)
    states = [each.state for each in results]
    assert states == ['tracked', 'empty']
    assert results[0].track_id == 1
    assert not track.tracker.tracks()[0].attendance.silent
    unknown = Told(1, 'detector', lookout=lookout)
    lookout._seen.clear()
    for _ in range(30):
        lookout.see(Figure(60), unknown.stamp_ns)
        (result,) = unknown.show(Figure(60))
    assert (result.state == 'tracked') == found


def test_of_whom_is_found_again_it_is_known_how_reliably_they_are_seen():
    attendance = Attendance()
    for _ in range(12):
        attendance.add(HERE, [BOX])
    for _ in range(3):
        attendance.add(ELSEWHERE, [BOX])
    again = attendance.renewed()
    assert not again.is_doubted
    for _ in range(3):
        again.add(ELSEWHERE, [BOX])
    assert again.is_doubted


def test_who_is_found_again_by_a_detector_is_soon_missed_again():
    track, network = told()
    # Farther away by then, so that nothing but the detector finds them.
    path = [*walk(Figure(60), 50), *walk(Figure(270, height=60), 40, -1.0)]
    states = []
    for number, figure in enumerate(path):
        network.boxes = [figure.box] if number < 40 or 50 <= number < 55 else []
        (result,) = track.show(*[figure] * (number < 40 or number >= 50))
        states.append(result.state)
    assert states[49] == 'lost'
    assert states[55] == 'tracked'
    assert states[77] == 'lost'
    assert result.track_id == 1


class Followed:
    """A track as far as a detector is concerned."""

    def __init__(self, state: str, box: Box) -> None:
        self.state, self.attendance, self.box = state, Attendance(), box
        self.seen_in: list[Box] = []

    def boxes_at(self, stamp_ns: int) -> tuple[Box, Box]:
        return self.box, self.box

    sought_in = boxes_at

    def see_box(self, box: Box, stamp_ns: int) -> None:
        self.seen_in.append(box)


def test_who_is_lost_takes_no_box_from_who_is_tracked(monkeypatch):
    lost, tracked = Followed('lost', BOX), Followed('tracked', BOX.shifted(9, 0))
    slots = Slots(small_bank(), TrackingConfig(), 1)
    monkeypatch.setattr(slots, 'followed', lambda: [lost, tracked])
    slots.witness(Sighting(1, (Detection(BOX, 0.9),)))
    assert (lost.seen_in, tracked.seen_in) == ([], [BOX])

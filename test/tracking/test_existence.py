# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from gait_segmentation.detector.detection import Detection, SoftMask
from gait_segmentation.detector.networks import DetectorConfig, Networks
from gait_segmentation.detector.scheduler import Detections, DetectorScheduler
from gait_segmentation.starting import StartingConfig
from gait_segmentation.tracking.existence import CERTAIN, Existence
from test.tracking.figures import STEP_NS, WIDTH, Figure, Told, walk

TALL, SMALL = 0.4, 0.1
S = 10**9


def looks(pattern, score=0.9, share=TALL):
    """Return the existence after looks that saw them (x) or not (.)."""
    existence = Existence(S)
    for each in pattern:
        existence = existence.seen(score, share) if each == 'x' else existence.unseen()
    return existence


def misses_until_doubted(pattern):
    existence = looks(pattern)
    for count in range(1, 1000):
        existence = existence.unseen()
        if existence.log_odds(S) < 0:
            assert 'detector' in existence.doubt(S)
            again = existence.seen(0.9, TALL)
            assert (again.log_odds(S) > 0, again.missed) == (True, 0)
            return count
    return 0


def test_silence_says_the_more_the_more_reliably_somebody_was_seen_before():
    always, often, rarely = 'x' * 12, 'xx.' * 4, 'x...' * 3
    assert misses_until_doubted(always) <= 3
    assert 3 < misses_until_doubted(often) < misses_until_doubted(rarely)


def test_of_whom_is_found_again_it_is_known_how_reliably_they_are_seen():
    again = looks('x' * 12 + '...').seen_again()
    assert again.log_odds(S) > 0
    assert again.unseen().unseen().unseen().log_odds(S) < 0


@pytest.mark.parametrize(
    ('score', 'share', 'looked', 'begins'),
    [
        (0.62, TALL, 'x', True),
        (0.5, TALL, 'xx', False),
        (0.9, TALL, 'x', True),
        (0.5, SMALL, 'x', False),
        (0.5, SMALL, 'xx', True),
        (0.55, SMALL, 'x', True),
        (0.3, SMALL, 'xxxx', False),
    ],
)
def test_of_the_small_less_is_asked_than_of_the_tall(score, share, looked, begins):
    assert (looks(looked, score, share).log_odds(S) >= 0) == begins


@pytest.mark.parametrize(
    ('score', 'share', 'drawn', 'begins'),
    [
        (0.3, SMALL, [5.0], True),
        (0.3, SMALL, [-1.0], False),
        (0.5, TALL, [5.0], True),
        (0.62, SMALL, [-1.5], True),
        (0.8, TALL, [-1.5], False),
        (0.8, TALL, [-30.0], False),
        (0.95, TALL, [-1.5], True),
        (0.62, TALL, [5.0, -4.0], True),
        (0.62, TALL, [5.0, -4.0, 5.0], True),
        (0.62, TALL, [5.0] + 8 * [-8.0], False),
        (0.62, TALL, 8 * [-8.0] + [5.0], True),
    ],
)
def test_a_network_that_draws_them_says_who_is_a_person(score, share, drawn, begins):
    existence = looks('x', score, share)
    for presence in drawn:
        existence = existence.drawn(presence, share)
    assert (existence.log_odds(S) >= 0) == begins


@pytest.mark.parametrize(
    ('score', 'share', 'stays'),
    [
        (0.6, TALL, False),
        (0.8, TALL, True),
        (0.94, TALL, True),
        (0.5, SMALL, False),
        (0.6, SMALL, True),
    ],
)
def test_what_rests_since_it_was_found_must_look_the_more_like_a_person(score, share, stays):
    existence = looks('xxx', score, share)
    assert existence.doubt(2 * S - 1) == ''
    assert ('hardly moved' not in existence.doubt(2 * S)) == stays
    assert existence.moving(S, 1.0).log_odds(9 * S) > 0


@pytest.mark.parametrize(
    ('score', 'presence', 'seconds', 'stays'),
    [
        (0.45, 5.0, 1, True),
        (0.45, 5.0, 2, True),
        (0.55, -4.0, 1, False),
        (0.45, 5.0, 5, False),
        (0.55, 5.0, 5, True),
        (0.55, 5.0, 60, True),
    ],
)
def test_who_rests_and_is_drawn_there_need_not_move_soon(score, presence, seconds, stays):
    existence = looks('xxx', score, SMALL)
    for _ in range(8):
        existence = existence.drawn(presence, SMALL)
    assert ('hardly moved' not in existence.doubt((1 + seconds) * S)) == stays


def test_what_was_said_long_ago_does_not_count():
    existence = looks('x' * 20, 0.4)
    for _ in range(9):
        existence = existence.seen(0.9, TALL)
    assert existence.log_odds(9 * S) > 0


@pytest.mark.parametrize(('score', 'person'), [(0.35, False), (0.5, True)])
def test_what_moves_and_hardly_looks_like_a_person_is_none(score, person):
    existence = looks('x' * 9, score).moving(S, 1.0)
    assert (existence.log_odds(2 * S) >= 0) == person
    assert ('hardly looks' in existence.doubt(2 * S)) != person


def test_what_hardly_moves_is_on_trial_for_some_seconds():
    existence = looks('xxx').moving(S, 0.05)
    assert existence.is_on_trial(2 * S)
    assert not existence.is_on_trial(9 * S)
    assert not existence.moving(2 * S, 0.3).is_on_trial(2 * S)


@pytest.mark.parametrize(('share', 'person'), [(0.02, False), (0.3, True)])
def test_what_hardly_moves_rests(share, person):
    existence = looks('x' * 9, 0.6).moving(S, share).moving(2 * S, 0.01)
    assert (existence.log_odds(9 * S) >= 0) == person
    assert ('hardly moved' in existence.doubt(9 * S)) != person


def test_what_ceases_to_move_and_looks_otherwise_is_doubted_until_it_moves():
    existence = looks('xxx').moving(S, 1.0)
    assert not existence.is_at_rest(S + S // 5)
    assert existence.is_at_rest(S + S // 2)
    assert existence.resting(alike=True) == existence
    other = existence.unseen().resting(alike=False)
    assert 'otherwise' in other.doubt(2 * S)
    assert other.moving(2 * S, 1.0).doubt(2 * S) == ''


def test_whom_a_detector_sees_at_rest_may_look_otherwise():
    existence = looks('xxx').moving(S, 1.0)
    assert existence.resting(alike=False) == existence
    other = existence.unseen().resting(alike=False)
    for again in (other.seen(0.9, TALL), other.seen_again()):
        assert again.doubt(2 * S) == ''
    # Nobody looks, or hardly sees them.
    for hardly in (Existence(S, given=True), looks('xxx', 0.6)):
        assert hardly.moving(S, 1.0).resting(alike=False).doubt(2 * S) != ''


def test_whose_box_is_given_is_a_person_until_they_are_not_there():
    given = Existence(S, given=True)
    assert given.log_odds(99 * S) == CERTAIN
    for _ in range(9):
        given = given.unseen()
    assert given.log_odds(99 * S) < 0


class Network:
    """A detector that sees what it is told to."""

    def __init__(self):
        self.boxes = []

    def __call__(self, image):
        return [Detection(box, 0.9) for box in self.boxes]


def told(slots=1):
    network = Network()
    return Told(slots, scheduler=DetectorScheduler(networks=Networks(network))), network


def test_who_is_seen_is_tracked_and_followed():
    track, network = told()
    for number, figure in enumerate(walk(Figure(60), 20)):
        network.boxes = [figure.box]
        (result,) = track.show(figure)
        assert result.state == 'tracked', number
        assert result.body.iou(figure.box) > 0.5


@pytest.mark.parametrize('working_height', [40, 128])
def test_how_tall_somebody_is_is_measured_in_the_image_as_it_came(working_height):
    track, figure = Told(working_height=working_height), Figure(100, height=50)
    track.start(figure)
    track.show(figure)
    (person,) = track.tracker.tracks()
    person.see(Detection(figure.box, 0.5), STEP_NS)
    share = figure.box.height / WIDTH
    assert person.existence.said == looks('x', 0.5, share).said


def test_of_whom_has_not_moved_yet_every_mask_tells_whether_they_are_a_person():
    track, figure = Told(), Figure(100)
    track.start(figure)
    track.show(figure)
    (person,) = track.tracker.tracks()
    mask = SoftMask(np.zeros((9, 9), np.uint8), 1.0, (0.0, 0.0), figure.box, presence=-3.0)
    before = person.existence
    assert person.drawn_now() is None
    person.take_mask(mask, figure.box)
    assert person.drawn_now() is mask
    assert person.existence == before.drawn(-3.0, figure.box.height / WIDTH)
    person.existence = moved = person.existence.moving(S, 1.0)
    person.take_mask(mask, figure.box)
    assert person.existence == moved
    track.show(figure)
    assert person.drawn_now() is None


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


@pytest.mark.parametrize(('least', 'found'), [(0.2, True), (0.4, False)])
def test_who_is_smaller_than_is_asked_for_does_not_begin(least, found):
    track, network = told()
    track.tracker.starting = StartingConfig(least_height=least)
    network.boxes = [Figure(100).box]
    results = [track.show(Figure(100))[0] for _ in range(5)]
    assert any(result.track_id for result in results) == found


@pytest.mark.parametrize(('least_share', 'state'), [(0.5, 'tracked'), (0.2, 'lost')])
def test_who_is_too_small_for_a_look_is_not_missed_by_it(least_share, state):
    figure = Figure(100)
    networks = Networks(
        lambda image: [],
        closely=lambda image: [Detection(figure.box, 0.9)],
        least_share=least_share,
    )
    once = DetectorConfig(urgent_period=0.04, calm_period=0.04, close_period=9.0)
    track = Told(1, scheduler=DetectorScheduler(once, networks))
    for _ in range(40):
        (result,) = track.show(figure)
    assert result.state == state


@pytest.mark.parametrize(
    ('height', 'slots', 'close'), [(100, 1, 1), (100, 2, 20), (17, 1, 20)], ids=str
)
def test_it_looks_closer_while_there_is_room_or_somebody_small_is_there(height, slots, close):
    figure, looks = Figure(100, height=height), []

    def closely(image):
        looks.append(image)
        return [Detection(figure.box, 0.9)]

    networks = Networks(lambda image: [Detection(figure.box, 0.9)], closely=closely)
    often = DetectorConfig(urgent_period=0.04, calm_period=0.04, close_period=0.04)
    track = Told(slots, scheduler=DetectorScheduler(often, networks))
    for _ in range(20):
        track.show(figure)
    assert len(looks) == close


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


class Late(DetectorScheduler):
    """Says so many frames later what was there."""

    def __init__(self, frames):
        super().__init__(networks=Networks(lambda image: []))
        self._frames, self._seen = frames, []

    def see(self, figure, stamp_ns):
        self._seen.append(Detections(stamp_ns, (Detection(figure.box, 0.9),)))

    def look(self, image, stamp_ns, **asked):
        return self._seen[-1 - self._frames] if len(self._seen) > self._frames else None


@pytest.mark.parametrize(('frames', 'found'), [(0, True), (8, True), (12, True), (24, False)])
def test_what_is_said_late_is_of_where_people_were_then(frames, found):
    scheduler = Late(frames)
    track = Told(2, scheduler=scheduler)
    for figure in walk(Figure(60), 60):
        scheduler.see(figure, track.stamp_ns)
        results = track.show(figure)
        if frames and not track.tracker.tracks():
            # Whoever is found late is where they were; here they are told.
            track.start(figure)
    states = [each.state for each in results]
    assert states == ['tracked', 'empty']
    assert results[0].track_id == 1
    assert not track.tracker.tracks()[0].existence.missed
    unknown = Told(1, scheduler=scheduler)
    scheduler._seen.clear()
    for _ in range(30):
        scheduler.see(Figure(60), unknown.stamp_ns)
        (result,) = unknown.show(Figure(60))
    assert (result.state == 'tracked') == found


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


@pytest.mark.parametrize(('score', 'often'), [(0.2, False), (0.55, True)])
def test_it_looks_often_while_somebody_may_come_but_not_for_what_is_hardly_one(score, often):
    figure, looks = Figure(100), []

    def people(image):
        looks.append(image)
        return [Detection(figure.box, 0.9), Detection(Figure(240, height=90).box, score)]

    track = Told(2, scheduler=DetectorScheduler(networks=Networks(people)), use_bystanders=False)
    for _ in range(51):
        track.show(figure)
    assert (len(looks) > 10) == often


@pytest.mark.parametrize(('apart', 'often'), [(60, True), (200, False)])
def test_it_looks_often_while_people_are_near_each_other(apart, often):
    figures, looks = [Figure(60), Figure(60 + apart)], []

    def people(image):
        looks.append(image)
        return [Detection(each.box, 0.9) for each in figures]

    track = Told(2, scheduler=DetectorScheduler(networks=Networks(people)))
    for _ in range(51):
        track.show(*figures)
    assert (len(looks) > 10) == often

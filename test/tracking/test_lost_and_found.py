# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""People who are hidden, leave, stand still, meet others, and bad input while they are tracked."""

import itertools
from dataclasses import replace

import cv2
import numpy as np
import pytest

from gait_segmentation.tracking.group import visible_silhouettes
from gait_segmentation.tracking.reidentification import reacquire
from gait_segmentation.tracking.state import Silhouette
from test.tracking.figures import BLUE, GREEN, RED, STEP_NS, WIDTH, Figure, Told, picture, walk

BOARD = (130, 190)


def hidden_share(figure: Figure) -> float:
    mask = figure.mask()
    return float((mask[:, BOARD[0] : BOARD[1]] > 0).sum() / (mask > 0).sum())


@pytest.mark.parametrize('shade', [False, True])
def test_somebody_hidden_is_lost_and_found_again(shade: bool) -> None:
    told = Told()
    path = walk(Figure(40), 75)
    if shade:
        lights = [float(np.interp(figure.x, (40, 120), (60, 20))) for figure in path]
        coats = [(round(light), round(light), round(8 / 3 * light)) for light in lights]
        path = [replace(each, coat=coat) for each, coat in zip(path, coats, strict=True)]
    results = told.follow(path, boards=[BOARD])
    shares = [hidden_share(figure) for figure in path]
    gone = [k for k, share in enumerate(shares) if share > 0.97]
    assert len(gone) >= 8
    for number in gone[3:]:
        result = results[number]
        assert (result.state, result.box, result.body) == ('lost', None, None)
        assert not result.likelihood.any()
        assert result.confidence < 0.3
        assert result.track_id == 1
    back = next(k for k in range(gone[-1], len(path)) if shares[k] < 0.3)
    again = next(k for k in range(gone[-1], len(path)) if results[k].state == 'tracked')
    assert again - back < 10
    for figure, result in zip(path[back + 10 :], results[back + 10 :], strict=True):
        assert result.track_id == 1
        assert result.box.iou(figure.box) > 0.7


def test_why_somebody_is_lost_and_why_a_track_ended_is_told() -> None:
    told = Told(patience=0.5)
    told.follow(walk(Figure(60), 10))
    assert told.show(Figure(90))[0].reason == ''
    reasons = [told.show(boards=[(0, WIDTH)])[0].reason for _ in range(20)]
    assert 'hidden' in reasons[3]
    assert 'not found for' in reasons[-1]
    told = Told()
    told.start(Figure(60))
    told.show(Figure(60))
    told.frames += 25
    assert 'no frame came for 1.0 s' in told.show()[0].reason


def test_the_patience_begins_anew_whenever_somebody_is_lost() -> None:
    into, out, back = walk(Figure(60), 25, 4.0), walk(Figure(156), 15, 4.0), Figure(212)
    path = [*into, *into[-1:] * 6, *out, *walk(back, 15, -4.0), *into[-1:] * 6]
    path += walk(Figure(156), 15, -4.0)
    results = Told(patience=1.0).follow(path, boards=[BOARD])
    states = [state for state, _ in itertools.groupby(each.state for each in results)]
    assert states == ['tracked', 'lost', 'tracked', 'lost', 'tracked']


@pytest.mark.parametrize(('width', 'lost'), [(8, 0), (18, 5), (20, 5), (22, 5)])
def test_somebody_behind_a_pole_does_not_shrink_and_is_soon_followed_again(
    width: int, lost: int
) -> None:
    told = Told()
    path = walk(Figure(40), 43)
    told.start(path[0])
    states = []
    for figure in path:
        image, masks = picture([figure], [(95, 95 + width)])
        (result,) = told.see(image, masks, [figure.mask()])
        states.append(result.state)
    assert states.count('lost') <= lost
    assert states[-10:] == ['tracked'] * 10
    assert result.track_id == 1
    assert result.box.iou(path[-1].box) > 0.8
    assert result.body.height == pytest.approx(path[-1].box.height, rel=0.1)


def test_somebody_who_turned_back_while_hidden_is_found_by_a_part_of_the_body() -> None:
    told = Told()
    path = [figure for figure in walk(Figure(40), 40) if hidden_share(figure) < 0.99]
    *_, result = told.follow([*path, *[path[-1]] * 35], boards=[BOARD])
    assert result.state == 'lost'
    for figure in walk(path[-1], 20, speed=-1.0):
        result = told.show(figure, boards=[BOARD])[0]
        assert result.state == 'tracked' or hidden_share(figure) > 0.6
        # Where they are, and not where they were going.
        if result.body is not None:
            assert abs(result.body.center_x - figure.x) < 0.06 * figure.height
    assert hidden_share(figure) < 0.5


def test_what_somebody_half_hidden_uncovers_is_learnt() -> None:
    told = Told()
    path = walk(Figure(108), 63, speed=0.5)
    told.follow(path, boards=[BOARD])
    assert 0.5 < hidden_share(path[-1]) < 0.95
    # Behind the coat or its rim until a quarter of it was hidden.
    column = 108
    (track,) = told.tracker.tracks()
    scale = track.view.scale
    known = track.view.background.count[round(scale * 78), round(scale * column)]
    assert known >= 1


def test_a_track_ends_when_somebody_who_left_does_not_come_back() -> None:
    told = Told(patience=0.6)
    path = walk(Figure(230), 40, 4.0)
    results = told.follow(path) + [told.show()[0] for _ in range(20)]
    states = [result.state for result in results]
    assert states[0] == 'tracked'
    first_lost = states.index('lost')
    assert path[first_lost].x > WIDTH - 25
    assert states.index('empty') - first_lost <= 0.6 / 0.04 + 2
    assert set(states[states.index('empty') :]) == {'empty'}
    assert results[-1].track_id == 0


@pytest.mark.parametrize('coat', [RED, GREEN])
def test_who_comes_back_soon_is_the_same_but_somebody_else_is_not(coat: tuple) -> None:
    told = Told(patience=3.0)
    out = walk(Figure(260), 25, 4.0)
    told.follow(out)
    for _ in range(8):
        told.show()
    back = walk(Figure(350, coat), 30, -4.0)
    states = []
    for figure in back:
        (result,) = told.show(figure)
        states.append(result.state)
    if coat == GREEN:
        assert set(states) == {'lost'}
    else:
        assert (result.state, result.track_id) == ('tracked', 1)
        assert result.box.iou(back[-1].box) > 0.6


def test_two_who_cross_keep_their_ids_and_share_the_pixels_out() -> None:
    told = Told(slots=2)
    far = walk(Figure(60, RED, height=92.0), 62)
    near = walk(Figure(250, BLUE, y=96.0, height=104.0), 62, -3.0)
    told.start(far[0], near[0])
    for behind, before in zip(far, near, strict=True):
        one, two = told.show(behind, before)
        both = (one.likelihood > 127) & (two.likelihood > 127)
        either = (behind.mask() > 0) | (before.mask() > 0)
        assert (both & either).sum() < 0.05 * either.sum()
    assert (one.track_id, two.track_id) == (1, 2)
    assert (one.state, two.state) == ('tracked', 'tracked')
    assert one.box.iou(far[-1].box) > 0.7
    assert two.box.iou(near[-1].box) > 0.7


@pytest.mark.parametrize(
    ('away', 'coat', 'pace', 'lost_s', 'passes'),
    [
        (10, RED, 1.0, 0.0, True),
        (60, RED, 1.0, 0.0, False),
        (10, GREEN, 1.0, 0.0, False),
        (10, RED, 0.1, 0.0, False),
        (10, RED, 1.0, 0.3, True),
        (10, RED, 1.0, 0.8, False),
    ],
)
def test_flow_follows_nobody_while_they_go_past_somebody_alike_even_if_just_hidden(
    away: float, coat: tuple, pace: float, lost_s: float, passes: bool
) -> None:
    told, pair = Told(slots=2), (Figure(100), Figure(170, coat))
    told.start(*pair)
    told.show(*pair)
    one, two = told.tracker.tracks()
    two.shift((away - 70) * two.view.scale, 0.0)
    if lost_s:
        two.enter('lost', 'as the test says')
    one.pose, two.lost_s = replace(one.pose, velocity=(pace * one.pose.height, 0.0)), lost_s
    assert (one.track_id not in visible_silhouettes([one, two])) == passes


@pytest.mark.parametrize(('speed', 'frames'), [(1.0, 70), (3.0, 60)])
def test_masks_of_both_do_not_draw_two_who_pass_each_other_aside(
    speed: float, frames: int
) -> None:
    told, half = Told(slots=2), speed * frames / 2
    far = walk(Figure(155 - half, height=98.0), frames, speed)
    near = walk(Figure(155 + half, y=92.0), frames, -speed)
    told.start(far[0], near[0])
    passed = 0
    for pair in zip(far, near, strict=True):
        image, masks = picture(pair)
        one, two = (figure.mask() for figure in pair)
        if np.count_nonzero(one & two) > 0.4 * np.count_nonzero(one):
            masks, passed = [one | two] * 2, passed + 1
        told.see(image, masks)
        if masks[0] is masks[1]:
            for track, figure in zip(told.tracker.tracks(), pair, strict=True):
                assert track.body.center_x == pytest.approx(figure.x, abs=3)
    assert passed > 2


@pytest.mark.parametrize(
    ('away', 'lost_s', 'taken', 'found'),
    [
        (30.0, 0.2, False, True),
        (30.0, 0.2, True, False),
        (200.0, 0.8, False, True),
        (200.0, 0.8, True, False),
        (200.0, 0.1, False, False),
    ],
)
def test_who_is_lost_is_sought_as_far_as_they_can_be_but_not_among_others(
    away: float, lost_s: float, taken: bool, found: bool
) -> None:
    told = Told()
    path = walk(Figure(60), 12)
    told.follow(path)
    (track,) = told.tracker.tracks()
    track.enter('lost', 'as the test says')
    track.lost_s = lost_s
    scale = track.view.scale
    track.shift(away * scale, 0.0)
    others = np.full(track.view.shape, 255 * taken, np.uint8)
    assert (reacquire(track, None, None, others) is not None) == found
    expected = path[-1].x + (0.0 if found else away)
    assert track.pose.center_x / scale == pytest.approx(expected, abs=4)
    reach = track.reach
    track.enter('tracked', '')
    assert track.reach < reach
    # Of whom nothing could be drawn nothing is sought.
    track.full = Silhouette(np.zeros_like(others), track.displacement)
    assert reacquire(track, None, None, 0 * others) is None


@pytest.mark.parametrize(
    ('pace', 'frames', 'place'),
    [
        # A little beyond the border.
        ((9e3, 0.0), 3, (WIDTH + 30, 90)),
        ((0.0, -9e3), 3, (60, -30)),
        # For a while, and then no more.
        ((20.0, 0.0), 100, (60 + 20 * (1.0 + 0.5), 90)),
    ],
)
def test_who_is_hidden_or_left_walks_on_and_is_waited_for(
    pace: tuple[float, float], frames: int, place: tuple[float, float]
) -> None:
    told = Told(patience=10.0)
    told.start(Figure(60))
    told.show(Figure(60))
    (track,) = told.tracker.tracks()
    track.pose = replace(track.pose, center_x=60.0, center_y=90.0, height=100.0, velocity=pace)
    for _ in range(frames):
        told.show(boards=[(0, WIDTH)])
    found = track.pose.center_x, track.pose.center_y
    assert found == pytest.approx(place, abs=2 * (frames > 3) + 1e-3)


# Input that is no good.


@pytest.mark.parametrize(
    ('gain', 'shift'), [(0.65, (0, 0)), (1.4, (0, 0)), (1.0, (40, 0)), (1.0, (-40, 12))]
)
def test_a_jump_of_the_exposure_or_of_the_camera_keeps_the_person(
    gain: float, shift: tuple
) -> None:
    told = Told()
    path = walk(Figure(140), 30, 1.5)
    told.start(path[0])
    for number, figure in enumerate(path):
        image, masks = picture([figure], shift=shift if number >= 15 else (0, 0))
        image = cv2.convertScaleAbs(image, alpha=gain) if number >= 15 else image
        (result,) = told.see(image, masks)
        assert result.state == 'tracked' or shift != (0, 0), number
    assert result.state == 'tracked'
    assert result.box.iou(path[-1].box.shifted(*shift)) > 0.7
    assert result.confidence > 0.6


@pytest.mark.parametrize('pattern', [(1, 2), (1, 1, 4), (1, 1, 1, 1, 8)])
def test_frames_that_are_missing_do_not_leave_a_fast_person_behind(pattern: tuple) -> None:
    told, x, steps = Told(), 30.0, itertools.cycle(pattern)
    told.start(Figure(x))
    while x < 290:
        [result] = told.show(Figure(x))
        assert abs(result.box.center_x - x) < 3
        step = next(steps)
        x += 12.0 * step
        told.frames += step - 1


def test_stamps_of_frames_that_arrive_together_do_not_tell_a_pace() -> None:
    class Hurried(Told):
        """Of every eight frames three come late, a millisecond apart."""

        @property
        def stamp_ns(self) -> int:
            late = self.frames % 8 - 4
            stamp_ns = super().stamp_ns
            return stamp_ns + (2 - late) * (STEP_NS - 1_000_000) if late in (0, 1, 2) else stamp_ns

    told = Hurried()
    first = Figure(40)
    told.start(first)
    for number, figure in enumerate(walk(first, 27, 6.0)):
        [result] = told.show(figure)
        assert abs(result.box.center_x - figure.x) < 3, number
    # Hidden as the last of them comes, somebody goes on no faster than before.
    last = figure
    for _ in range(5):
        [result] = told.show(boards=[(0, WIDTH)])
    for number in range(6, 9):
        [result] = told.show(replace(last, x=last.x + 6.0 * number))
    assert (result.track_id, result.state) == (1, 'tracked')


@pytest.mark.parametrize('gap', [20, 50, 90_000])
@pytest.mark.parametrize('moved', [0, 25, -40])
def test_after_a_gap_somebody_is_found_near_where_they_were_and_who_is_gone_is_lost(
    gap: int, moved: int
) -> None:
    told = Told(slots=2)
    stays, goes = walk(Figure(60), 20), walk(Figure(220, coat=BLUE), 20, speed=-1.0)
    told.start(stays[0], goes[0])
    for figures in zip(stays, goes, strict=True):
        told.show(*figures)
    told.frames += gap
    for figure in walk(replace(stays[-1], x=stays[-1].x + moved), 6, speed=-1.0):
        one, other = told.show(figure)
        assert (one.track_id, one.state) == (1, 'tracked')
        assert one.box.iou(figure.box) > 0.7
        assert other.state != 'tracked'
        assert not other.likelihood.any()


def test_who_was_not_back_at_once_after_a_gap_is_waited_for() -> None:
    """Nobody was looked for in the gap: it is not taken for their absence."""
    told = Told()
    path = walk(Figure(60), 20)
    told.follow(path)
    told.frames += 90_000
    told.show()
    assert [(each.track_id, each.state) for each in told.show(path[-1])] == [(1, 'tracked')]


def test_while_somebody_is_lost_the_place_is_followed_everywhere() -> None:
    told = Told()
    told.follow(walk(Figure(60), 3))
    (track,) = told.tracker.tracks()

    def followed() -> int:
        where = np.zeros(track.view.shape, np.uint8)
        for window in track.view.now.windows:
            where[window] = 1
        return int(where.sum())

    assert followed() < 0.5 * np.prod(track.view.shape)
    states = [told.show()[0].state for _ in range(3)]
    assert states[1:] == ['lost', 'lost']
    assert followed() == np.prod(track.view.shape)


def test_a_box_ends_at_the_border_of_an_image_that_working_pixels_do_not_fit() -> None:
    told = Told(working_height=55)
    results = told.follow(walk(Figure(280), 10, 4.0))
    (track,) = told.tracker.tracks()
    assert track.view.shape[1] / track.view.scale > WIDTH
    assert max(result.box.right for result in results) == WIDTH


def test_who_begins_where_they_stood_before_is_not_learnt_as_background_by_late_masks() -> None:
    told = Told(slots=2, late=3)
    one, two = Figure(60), Figure(110, BLUE)
    told.start(one)
    for number in range(20):
        image, masks = picture([one, two])
        if number == 10:
            told.start(two)
        results = told.see(image, masks)
    assert [result.state for result in results] == ['tracked', 'tracked']
    assert results[1].likelihood[masks[1] > 0].mean() > 200

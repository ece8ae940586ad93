# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import replace

import cv2
import numpy as np
import pytest

from gait_segmentation.errors import InputError
from gait_segmentation.geometry import BodyFrame, Box
from gait_segmentation.results import LOST, TRACKED, Feedback, TrackResult
from gait_segmentation.tracking import PeopleTracker, TrackingConfig
from test.tracking.figures import BLUE, GREEN, STEP_NS, Figure, Told, blind, ids, picture
from test.walkers import box_of, clip, small_bank


class Tracker:
    """A tracker of one slot."""

    def __init__(self, **changes) -> None:
        self.people = PeopleTracker(small_bank(), TrackingConfig(**changes), scheduler=blind())
        self.initialize, self.reset = self.people.initialize, self.people.reset

    def update(self, image: np.ndarray, stamp_ns: int) -> TrackResult:
        (result,) = self.people.update(image, stamp_ns)
        return result

    def learn(self, feedback: Feedback) -> None:
        self.people.learn([feedback])


def feedback(frame, result: TrackResult) -> Feedback:
    mask = frame.masks[0]
    prior = mask[: result.likelihood.shape[0], : result.likelihood.shape[1]]
    return Feedback(frame.stamp_ns, result.track_id, mask, None, prior)


def started(**changes) -> tuple[Tracker, TrackResult]:
    track = Tracker(**changes)
    track.initialize(box_of(clip()[0]))
    return track, track.update(clip()[0].image, clip()[0].stamp_ns)


@pytest.mark.parametrize('use_tilt', [True, False])
def test_a_leaning_person_is_tracked_leaning_from_the_first_frame(use_tilt: bool) -> None:
    height, width = clip()[0].image.shape[:2]
    turn = cv2.getRotationMatrix2D((width / 2 - 0.5, height / 2 - 0.5), -18, 1)
    image = cv2.warpAffine(clip()[0].image, turn, (width, height), borderMode=cv2.BORDER_REFLECT)
    box = Box.around(cv2.warpAffine(clip()[0].masks[0], turn, (width, height)) > 127)
    track = Tracker(use_tilt=use_tilt)
    track.initialize(box)
    angle = np.degrees(track.update(image, clip()[0].stamp_ns).angle)
    assert angle == pytest.approx(18 if use_tilt else 0, abs=8)


def test_feedback_of_others_and_of_frames_not_kept_is_ignored() -> None:
    (plain, result), (pestered, _) = started(), started()
    good = feedback(clip()[0], result)
    pestered.learn(replace(good, stamp_ns=123))
    pestered.learn(replace(good, track_id=99))
    plain.learn(good)
    pestered.learn(good)
    # That frame is not kept any more.
    pestered.learn(replace(good, mask=255 - good.mask))
    one, two, untaught = (
        each.update(clip()[1].image, clip()[1].stamp_ns).likelihood
        for each in (plain, pestered, started()[0])
    )
    np.testing.assert_array_equal(one, two)
    assert (one != untaught).any()


@pytest.mark.parametrize('back_ns', [0, 5_000_000, 7_200_000_000_000])
def test_a_stamp_that_is_not_later_is_refused_and_another_size_forgets(back_ns: int) -> None:
    track, _ = started()
    with pytest.raises(InputError, match=r'must (increase|be positive)'):
        track.update(clip()[0].image, clip()[0].stamp_ns - back_ns)
    assert track.update(clip()[1].image, clip()[1].stamp_ns).track_id == 1
    assert track.update(clip()[2].image[:200], clip()[2].stamp_ns).box is None


def nothing_of_the_scene(kind: str, number: int) -> np.ndarray:
    """Return a damaged frame: black, or one of noise that differs from the others."""
    shape = clip()[0].image.shape
    if kind == 'black':
        return np.zeros(shape, np.uint8)
    return np.random.default_rng(number).integers(0, 256, shape).astype(np.uint8)


@pytest.mark.parametrize('missed', [1, 3])
@pytest.mark.parametrize('kind', ['black', 'noise'])
def test_frames_that_show_nothing_of_the_scene_are_passed_over_and_many_lose(
    kind: str, missed: int
) -> None:
    track, states = Tracker(), []
    track.initialize(box_of(clip()[0]))
    for frame in clip()[:4]:
        track.learn(feedback(frame, track.update(frame.image, frame.stamp_ns)))
    for number, frame in enumerate(clip()[4 : 4 + missed]):
        result = track.update(nothing_of_the_scene(kind, number), frame.stamp_ns)
        track.learn(feedback(frame, result))
        assert result.likelihood.max() == 0
        states.append(result.state)
    assert states == [TRACKED, LOST, LOST][:missed]
    after = clip()[4 + missed]
    result = track.update(after.image, after.stamp_ns)
    assert result.state == TRACKED
    # If nothing is missing it is 0.82: legs and arms swing out of the box.
    assert result.box.iou(box_of(after)) > (0.78 if missed == 1 else 0.7)


def last_of_a_grey_clip(**changes) -> TrackResult:
    """Track a walker seen by a grey camera, whose shadows deepen from the fifth frame on."""
    deeper = np.interp(np.arange(256), [0, 80, 200, 255], [0, 60, 198, 255]).astype(np.uint8)
    track, frames = Tracker(**changes), clip()[:8]
    track.initialize(box_of(frames[0]))
    for number, frame in enumerate(frames):
        image = frame.image.mean(axis=2, keepdims=True).astype(np.uint8).repeat(3, axis=2)
        result = track.update(deeper[image] if number >= 5 else image, frame.stamp_ns)
        track.learn(feedback(frame, result))
    return result


@pytest.fixture(scope='module')
def all_parts() -> TrackResult:
    return last_of_a_grey_clip()


@pytest.mark.parametrize(
    'name',
    [
        'use_background',
        'use_shadow',
        'use_ego_motion',
        'use_texture',
        'use_motion_cue',
        'use_motion_gate',
    ],
)
def test_each_part_matters_and_can_be_switched_off(name: str, all_parts: TrackResult) -> None:
    result = last_of_a_grey_clip(**{name: False})
    assert result.box.iou(all_parts.box) > 0.6
    assert (result.likelihood != all_parts.likelihood).mean() > 0.003


def test_a_box_starts_the_slot_of_who_stands_there_anew_or_else_that_of_the_least_sure() -> None:
    told = Told(slots=2, patience=0.2)
    people = [Figure(60), Figure(150, BLUE)]
    told.start(*people)
    assert ids(told.show(*people)) == [1, 2]
    told.start(Figure(65))
    assert ids(told.show(*people)) == [3, 2]
    # The second stands behind a board.
    results = [told.show(*people, boards=[(125, 145)]) for _ in range(2)][-1]
    assert results[1].confidence < results[0].confidence
    told.start(Figure(250, GREEN))
    assert ids(told.show(*people, Figure(250, GREEN), boards=[(125, 145)])) == [3, 4]
    # Also where a slot before theirs is empty.
    image, (mask,) = picture([Figure(250, GREEN)])
    shown = image, [np.zeros_like(mask), mask]
    assert ids([told.see(*shown) for _ in range(10)][-1]) == [0, 4]
    told.start(Figure(250, GREEN))
    assert ids(told.see(*shown)) == [0, 5]


def test_people_of_one_size_share_a_view_and_others_have_their_own() -> None:
    told = Told(slots=3, working_height=60)
    people = (
        Figure(50, height=130.0),
        Figure(140, BLUE, height=120.0),
        Figure(250, GREEN, height=60.0),
    )
    told.start(*people)
    told.show(*people)
    first, second, third = (track.view for track in told.tracker.tracks())
    assert first is second
    assert third is not first
    for _ in range(2):
        told.show(*people)
    # Those of every view learn from their masks.
    assert [view.take(view.now.image.stamp_ns) for view in (first, third)] == [None, None]


def test_boxes_take_free_slots_in_order_and_ids_are_never_used_twice() -> None:
    told = Told(slots=3)
    people = (Figure(60), Figure(150, BLUE), Figure(240, GREEN))
    told.start(*people[:2])
    assert ids(told.show(*people)) == [1, 2, 0]
    told.start(people[2])
    *_, last = told.show(*people)
    assert last.track_id == 3
    told.tracker.reset()
    empty = told.show(*people)
    assert [(each.track_id, each.state, each.box) for each in empty] == [(0, 'empty', None)] * 3
    assert not any(each.likelihood.any() for each in empty)
    told.start(people[0])
    assert ids(told.show(*people)) == [4, 0, 0]


NOBODY = np.zeros((180, 320), np.uint8)


def lesson(stamp_ns: int = STEP_NS, mask: np.ndarray = NOBODY, **changes) -> Feedback:
    return replace(Feedback(stamp_ns, 1, mask, None, mask), **changes)


@pytest.mark.parametrize(
    ('refused', 'words'),
    [
        (lambda track: track.update(NOBODY, 2 * STEP_NS), r'got .*\(180, 320\)'),
        (lambda track: track.update(np.dstack([NOBODY] * 3), 0), 'positive'),
        (lambda track: track.initialize((5, 5, 20, 60)), r'Box, got \(5, 5, 20, 60\)'),
        (lambda track: track.learn([lesson(mask=NOBODY[:5])]), r'\(180, 320\)'),
        (lambda track: track.learn([lesson(), lesson(7, track_id=2)]), 'one frame'),
        (lambda track: track.learn([lesson(body=BodyFrame(60, 90, 1e7))]), 'at most'),
    ],
)
def test_what_makes_no_sense_is_refused_and_changes_nothing(refused, words: str) -> None:
    plain, asked = Told(), Told()
    for told in (plain, asked):
        told.start(Figure(60))
        told.show(Figure(60))
    with pytest.raises(InputError, match=words):
        refused(asked.tracker)
    for one, two in zip(plain.show(Figure(63)), asked.show(Figure(63)), strict=True):
        assert (one.track_id, one.box) == (two.track_id, two.box)
        np.testing.assert_array_equal(one.likelihood, two.likelihood)


def test_one_bad_box_is_refused_and_the_others_start() -> None:
    told = Told(slots=2)
    told.tracker.initialize(Box(500, 10, 20, 50))
    told.start(Figure(60))
    with pytest.raises(InputError, match='outside of the image'):
        told.show(Figure(60))
    assert ids(told.show(Figure(60))) == [1, 0]

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gait_segmentation.detector.networks import DetectorConfig
from gait_segmentation.errors import InputError
from gait_segmentation.matching import MatchingConfig
from gait_segmentation.people import PeopleConfig
from gait_segmentation.pipeline import FrameResult, Pipeline, PipelineConfig
from gait_segmentation.tracking import TrackingConfig
from test.walkers import box_of, clip, couple, overlap, small_bank


def pipeline(lag: int = 0, network: str = 'boxes') -> Pipeline:
    detector = DetectorConfig(network=network)
    config = PipelineConfig(TrackingConfig(), MatchingConfig(lag=lag), detector=detector)
    return Pipeline(config, small_bank())


def started(lag: int = 0, network: str = 'boxes') -> Pipeline:
    pipe = pipeline(lag, network)
    pipe.initialize(box_of(clip()[0]))
    return pipe


def run(lag: int = 0, frames: int = 16, network: str = 'boxes') -> list[FrameResult]:
    pipe = started(lag, network)
    results = []
    for frame in clip()[:frames]:
        results += pipe.update(frame.image, frame.stamp_ns)
    return results + pipe.flush()


def test_a_walker_is_segmented_from_the_first_box_alone() -> None:
    results = run(network='people')
    for result, frame in zip(results, clip(), strict=True):
        (each,) = result.people
        stages = (each.track, each.match, each.segmentation)
        assert {result.stamp_ns, *(stage.stamp_ns for stage in stages)} == {frame.stamp_ns}
        assert {stage.track_id for stage in stages} == {1}
    scores = [
        overlap(each.mask, frame.truths[0]) for each, frame in zip(results, clip(), strict=True)
    ]
    assert np.mean(scores) > 0.8
    assert np.mean(scores[-5:]) > 0.85


@pytest.mark.parametrize('lag', [0, 1, 2])
def test_the_buffer_of_a_frame_may_be_filled_again_after_the_call(lag: int) -> None:
    pipe, buffer, results = started(lag), np.empty_like(clip()[0].image), []
    for frame in clip()[:6]:
        buffer[:] = frame.image
        results += pipe.update(buffer, frame.stamp_ns)
    for found, same in zip(results + pipe.flush(), run(lag, 6), strict=True):
        np.testing.assert_array_equal(found.mask, same.mask)


def test_nobody_gives_empty_results() -> None:
    [frame] = pipeline(network='people').update(np.full_like(clip()[0].image, 90), 5)
    [result] = frame.people
    assert result.track.box is None
    assert result.track.state == 'empty'
    assert result.match.body is None
    assert not result.segmentation.mask.any()
    assert result.segmentation.reason == 'no person is tracked'
    assert not frame.mask.any()
    assert not frame.labels.any()


@pytest.mark.parametrize('lag', [0, 2])
def test_stale_frames_are_dropped_and_change_nothing(lag: int) -> None:
    order = (0, 1, 3, 2, 6, 4, 6, 7)
    stale = (2, 4)
    found = []
    for numbers in (order, (0, 1, 3, 6, 7)):
        pipe = started(lag)
        results = []
        for k, n in enumerate(numbers):
            # Whatever the image.
            image = clip()[n].image[:100] if n in order[:k] else clip()[n].image
            results += pipe.update(image, clip()[n].stamp_ns)
        found.append((pipe.stale, results + pipe.flush()))
    (dropped, results), (none, others) = found
    assert (dropped, none) == (len(stale) + 1, 0)
    for one, other in zip(results, others, strict=True):
        assert one.stamp_ns == other.stamp_ns
        assert other.mask.any()
        np.testing.assert_array_equal(one.mask, other.mask)


def test_a_heat_map_is_evidence_beside_the_trackers_own() -> None:
    plain, told = pipeline(), pipeline()
    contrasts = []
    for pipe in (plain, told):
        pipe.initialize(box_of(clip()[0]))
        for frame in clip()[:4]:
            heat = frame.masks[0][::2, ::2] if pipe is told else None
            [result] = pipe.update(frame.image, frame.stamp_ns, heat_map=heat)
        values, inside = result.people[0].track.likelihood, frame.masks[0] > 0
        contrasts.append(float(values[inside].mean()) - float(values[~inside].mean()))
    assert contrasts[1] > contrasts[0] + 1
    with pytest.raises(InputError):
        told.update(
            frame.image, frame.stamp_ns + 1_000_000, heat_map=np.zeros((5, 5, 2), np.uint8)
        )
    assert len(told.update(frame.image, frame.stamp_ns + 1_000_000)) == 1


def test_a_map_of_something_else_changes_nothing() -> None:
    plain, told = started(), started()
    for frame in clip()[:6]:
        mirrored = frame.masks[0][:, ::-1]
        [one] = plain.update(frame.image, frame.stamp_ns)
        [two] = told.update(frame.image, frame.stamp_ns, heat_map=mirrored)
        np.testing.assert_array_equal(one.mask, two.mask)
        person, other = one.people[0].track, two.people[0].track
        np.testing.assert_array_equal(person.likelihood, other.likelihood)


@pytest.mark.parametrize('lag', [0, 2])
def test_callers_may_reuse_what_they_gave_and_write_to_what_they_got(lag: int) -> None:
    box = box_of(clip()[0])
    plain, careless = pipeline(lag), pipeline(lag)
    image, heat = np.empty_like(clip()[0].image), np.empty_like(clip()[0].masks[0])
    given = [None, None, None, heat, None, None]
    masks = []
    for pipe in (plain, careless):
        pipe.initialize(box)
        found = []
        for frame, outer in zip(clip()[:6], given, strict=True):
            own = frame.masks[0] // 2 + 60
            if pipe is careless:
                image[...], heat[...] = frame.image, own
                results = pipe.update(image, frame.stamp_ns, heat_map=outer)
            else:
                own = None if outer is None else own
                results = pipe.update(frame.image.copy(), frame.stamp_ns, heat_map=own)
            for result in [*results, *(pipe.flush() if frame is clip()[5] else [])]:
                found.append(result.mask.copy())
                if pipe is careless:
                    [person] = result.people
                    for array in (result.mask, result.labels, person.segmentation.mask):
                        array[...] = 255
                    person.match.shape_prior[...] = person.track.likelihood[...] = 99
        masks.append(found)
    assert len(masks[0]) == 6
    for one, two in zip(*masks, strict=True):
        assert np.array_equal(one, two)


@pytest.mark.parametrize('asked', [True, False])
def test_results_can_be_had_before_they_are_learnt_from(asked: bool, monkeypatch) -> None:
    pipe = started()
    learnt: list[int] = []
    learn = pipe.tracker.learn
    monkeypatch.setattr(
        pipe.tracker, 'learn', lambda each: (learnt.append(each[0].stamp_ns), learn(each))
    )
    for number, (frame, plain) in enumerate(zip(clip()[:6], run(frames=6), strict=True)):
        [result] = pipe.update(frame.image, frame.stamp_ns, learn=False)
        assert len(learnt) == number
        assert (result.mask == plain.mask).all()
        if asked:
            pipe.apply_feedback()
            assert learnt[-1] == frame.stamp_ns


SECOND = 4
"""The frame in which the second person of a couple is started."""


def several(lag: int = 0, slots: int = 3, people: int = 2) -> list[FrameResult]:
    config = PipelineConfig(
        TrackingConfig(),
        MatchingConfig(lag=lag),
        people=PeopleConfig(max_people=slots),
        detector=DetectorConfig(network='none'),
    )
    pipe = Pipeline(config, small_bank())
    results = []
    for index, frame in enumerate(couple()):
        number = {0: 0, SECOND: 1}.get(index, people)
        if number < people:
            pipe.initialize(box_of(frame, number))
        results += pipe.update(frame.image, frame.stamp_ns)
    return results + pipe.flush()


def test_people_have_slots_of_their_own_and_labels_agree_with_masks() -> None:
    results = several()
    assert [each.stamp_ns for each in results] == [frame.stamp_ns for frame in couple()]
    states = [[person.track.state for person in each.people] for each in results]
    alone, both = ['tracked', 'empty', 'empty'], ['tracked', 'tracked', 'empty']
    assert states == [alone] * SECOND + [both] * (len(couple()) - SECOND)
    for each in results:
        assert len(each.people) == 3
        for slot, person in enumerate(each.people):
            assert np.array_equal((each.labels == slot + 1) * 255, person.segmentation.mask)
        assert np.array_equal((each.labels > 0) * 255, each.mask)
    for slot in (0, 1):
        assert results[-1].people[slot].track.track_id == slot + 1
        assert (
            overlap(results[-1].people[slot].segmentation.mask, couple()[-1].truths[slot]) > 0.75
        )


def test_timings_come_from_the_clock_given() -> None:
    ticks = iter(range(1000))
    pipe = Pipeline(replace(PipelineConfig()), small_bank(), clock=lambda: float(next(ticks)))
    [result] = pipe.update(clip()[0].image, 5)
    assert result.timings_ms['matching'] == 1000
    assert result.timings_ms['total'] >= 3000
    # Learning counts as tracking, also if it comes later.
    [result] = pipe.update(clip()[1].image, 1_000_000, learn=False)
    before = dict(result.timings_ms)
    pipe.apply_feedback()
    assert result.timings_ms['tracking'] == before['tracking'] + 1000
    assert result.timings_ms['total'] == before['total'] + 1000
    assert pipeline().update(clip()[0].image, 5)[0].timings_ms['total'] == 0

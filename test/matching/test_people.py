# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import math
from dataclasses import replace

import numpy as np
import pytest

from gait_segmentation.errors import InputError
from gait_segmentation.geometry import Box
from gait_segmentation.matching import MatchingConfig, PeopleMatcher, SequenceMatcher
from gait_segmentation.results import LOST, TRACKED, TrackResult
from test.walkers import clip, small_bank

SIZE = (320, 240)


def tracks(index: int, *seen: bool) -> list[TrackResult]:
    """Return slots in which the walker is seen or nobody is."""
    frame = clip(pan=0.0)[index]
    black = np.zeros_like(frame.masks[0])
    return [
        TrackResult(frame.stamp_ns, 1 + slot, frame.boxes[0], frame.masks[0], 1.0)
        if each
        else TrackResult(frame.stamp_ns, 0, None, black, 0.0)
        for slot, each in enumerate(seen)
    ]


def people(slots: int = 2, **changes) -> PeopleMatcher:
    return PeopleMatcher(small_bank(), MatchingConfig(**changes), max_people=slots)


def test_a_lag_tells_of_each_frame_where_the_bodies_were_in_it() -> None:
    """To a part of a step between placements, as nothing in later frames says otherwise."""
    direct, late = people(), people(lag=3)
    now, then = [], []
    for index in range(14):
        now += direct.update(tracks(index, True, True), source_size=SIZE)
        then += late.update(tracks(index, True, True), source_size=SIZE)
    then += late.flush()
    for slot in (0, 1):
        pairs = [(a[slot], b[slot]) for a, b in zip(now, then, strict=True)]
        assert [a.stamp_ns for a, _ in pairs] == [b.stamp_ns for _, b in pairs]
        for a, b in pairs:
            # Less than a step between placements; in a frame the walker goes further.
            assert abs(a.body.center_x - b.body.center_x) < 0.02 * a.body.height
            assert abs(a.body.center_y - b.body.center_y) < 0.02 * a.body.height
            assert abs(math.log(a.body.height / b.body.height)) < 0.04
        assert len({a.placement for a, _ in pairs}) == len(pairs)


@pytest.mark.parametrize('door', [True, False])
def test_a_frame_that_cannot_be_used_is_skipped_in_all_slots(door, monkeypatch) -> None:
    matcher = people(lag=1)
    matcher.update(tracks(0, True, True), source_size=SIZE)
    good, bad = tracks(1, True, True)
    if door:
        bad = replace(bad, likelihood=np.zeros((7, 320), np.uint8))
    else:
        # An error that nothing refuses, in the second slot.
        update = SequenceMatcher.add_frame

        def failing(slot, track, *more):
            if track.track_id == 2:
                raise RuntimeError('no proportions')
            return update(slot, track, *more)

        monkeypatch.setattr(SequenceMatcher, 'add_frame', failing)
    with pytest.raises(InputError if door else RuntimeError, match='proportions'):
        matcher.update([good, bad], source_size=SIZE)
    monkeypatch.undo()
    matcher.update(tracks(2, True, True), source_size=SIZE)
    ((one, two),) = matcher.update(tracks(3, True, True), source_size=SIZE)
    assert one.stamp_ns == two.stamp_ns == clip(pan=0.0)[2].stamp_ns


def crossed(index: int, front: str) -> list[TrackResult]:
    """Return a walker half hidden by another one, who stands nearer, and that one."""
    frame = clip(pan=0.0)[index]
    box, mask = frame.boxes[0], frame.masks[0]
    right, down = round(0.5 * box.width), round(0.05 * box.height)
    nearer = np.roll(mask, (down, right), axis=(0, 1))
    behind = np.where(nearer > 127, 0, mask).astype(np.uint8)
    return [
        TrackResult(frame.stamp_ns, 1, box, behind, 1.0),
        TrackResult(frame.stamp_ns, 2, box.shifted(right, down), nearer, 1.0, state=front),
    ]


def test_what_somebody_nearer_hides_counts_neither_way() -> None:
    similarity = {}
    for front in (TRACKED, LOST):
        matcher = people()
        for index in range(4):
            ((one, two),) = matcher.update(crossed(index, front), source_size=SIZE)
        similarity[front] = one.similarity, two.similarity
    assert similarity[TRACKED][0] > similarity[LOST][0] + 0.05
    assert similarity[TRACKED][1] == similarity[LOST][1]


def test_it_does_not_matter_how_large_the_image_is_that_people_hide_each_other_in() -> None:
    similarity = []
    for scale in (1, 2):
        matcher, size = people(), (scale * SIZE[0], scale * SIZE[1])
        for index in range(4):
            seen = [
                replace(each, body=each.body.scaled(scale), box=each.box.scaled(scale))
                for each in crossed(index, TRACKED)
            ]
            (found,) = matcher.update(seen, source_size=size)
        similarity.append([each.similarity for each in found])
    assert similarity[0] == pytest.approx(similarity[1], abs=1e-3)


def test_who_is_new_in_a_slot_hides_nothing_by_how_who_had_it_before_stood() -> None:
    similarity = []
    for changes in ({'track_id': 9}, {'state': LOST}):
        matcher = people()
        for index in range(4):
            matcher.update(crossed(index, TRACKED), source_size=SIZE)
        behind, front = crossed(4, TRACKED)
        ((one, _),) = matcher.update([behind, replace(front, **changes)], source_size=SIZE)
        similarity.append(one.similarity)
    assert similarity[0] == similarity[1]


@pytest.mark.parametrize(
    ('changes', 'size', 'words'),
    [
        ({'body': Box(0, 0, 1e7, 1e7)}, SIZE, 'pixels large'),
        ({'body': Box(0, 0, 1e-6, 1e-6)}, SIZE, 'pixels large'),
        ({'body': Box(1e9, 0, 9, 9)}, SIZE, 'pixels from the centre'),
        ({'angle': float('inf')}, SIZE, 'angle must be a finite'),
        ({'likelihood': np.zeros((240, 320))}, SIZE, 'uint8'),
        ({'likelihood': np.zeros((240, 320, 3), np.uint8)}, SIZE, 'height, width'),
        ({'likelihood': np.zeros((0, 320), np.uint8)}, SIZE, 'proportions'),
        ({'likelihood': np.zeros((0, 0), np.uint8)}, (1, 1), 'proportions'),
        ({'stamp_ns': 0}, SIZE, 'positive'),
        ({'stamp_ns': 1}, SIZE, 'must increase'),
        ({}, (0, 240), 'source size must be positive'),
    ],
    ids=str,
)
def test_a_track_that_makes_no_sense_changes_nothing(changes, size, words) -> None:
    plain, asked = people(lag=1), people(lag=1)
    for each in (plain, asked):
        each.update(tracks(0, True, True), source_size=SIZE)
    for index in range(1, 4):
        one, two = tracks(index, True, True)
        with pytest.raises(InputError, match=words):
            asked.update([replace(one, **changes), two], source_size=size)
        found = asked.update([one, two], source_size=SIZE)
        expected = plain.update([one, two], source_size=SIZE)
        assert [[each.body for each in frame] for frame in found] == [
            [each.body for each in frame] for frame in expected
        ]

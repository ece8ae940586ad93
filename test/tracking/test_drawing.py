# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from unittest.mock import Mock

import numpy as np

from gait_segmentation.detector.detection import Detection, SoftMask
from gait_segmentation.geometry import Box
from gait_segmentation.tracking.drawing import draw_known, draw_new
from gait_segmentation.tracking.tentative import follow

S = 10**9
BOXES = [Box(10 + 100 * number, 10, 40, 100) for number in range(3)]


def mask_of(part: tuple[slice, slice]) -> SoftMask:
    """Return a mask of a part of an image of 120 x 340 pixels."""
    values = np.zeros((120, 340), np.uint8)
    values[part] = 255
    return SoftMask(values, 1.0, (0.0, 0.0), Box(0, 0, 340, 120), 5.0)


def test_who_has_no_mask_yet_is_drawn_first_and_then_who_is_likelier() -> None:
    asked: list[Box] = []

    def draw(boxes: list[Box], *, always: bool = False) -> list[SoftMask]:
        asked.extend(boxes)
        return [SoftMask(np.zeros((2, 2), np.uint8), 1.0, (0, 0), boxes[0], 5.0)]

    seen = [Detection(box, score) for box, score in zip(BOXES, (0.9, 0.5, 0.6), strict=True)]
    found, _ = follow([], seen, S, 320, lambda box: False)
    drawn = draw_new(draw, found, S, 320, late=False)
    assert asked == [BOXES[0], BOXES[2], BOXES[1]]
    assert [each.existence.present for each in drawn] == [2.5, None, None]
    asked.clear()
    draw_new(draw, drawn, S + 1, 320, late=False)
    assert asked == [BOXES[2], BOXES[1], BOXES[0]]


def test_who_was_detected_late_begins_only_where_a_second_mask_shows_them() -> None:
    drawn_in: list[Box] = []
    gone_on, other = BOXES[0].shifted(30, 0), BOXES[2]

    def draws(*shown: Box) -> list[Box]:
        """Return the boxes that begin if masks show these, one after the other."""
        masks = iter(shown)

        def draw(boxes: list[Box], *, always: bool = False) -> list[SoftMask]:
            drawn_in.extend(boxes)
            values = np.zeros((200, 400), np.uint8)
            box = next(masks)
            values[box.slices(400, 200)] = 255
            return [SoftMask(values, 1.0, (0, 0), box, 5.0)]

        found, _ = follow([], [Detection(BOXES[0], 0.9)], S, 320, lambda box: False)
        return [each.detection.box for each in draw_new(draw, found, S, 320, late=True)]

    assert draws(gone_on, gone_on) == [gone_on]
    assert drawn_in == [BOXES[0], gone_on]
    assert draws(gone_on, other) == []


def test_whose_last_mask_is_oldest_is_drawn_first_and_those_without_a_slot_half_as_often() -> None:
    def track(slot: int | None, masked_ns: int) -> Mock:
        return Mock(slot=slot, masked_ns=masked_ns, detected_in=lambda stamp_ns: BOXES[0])

    tracks = track(0, 6 * S), track(None, 5 * S), track(None, S), track(1, 7 * S)
    for count, drawn in (1, [2]), (2, [2, 0]), (3, [2, 0, 3]), (4, [2, 0, 3, 1]):
        for each in tracks:
            each.take_mask.reset_mock()
        draw_known(lambda boxes, count=count: [mask_of(np.s_[:0, :0])] * count, tracks, 10 * S)
        assert sorted(drawn) == [k for k, each in enumerate(tracks) if each.take_mask.called]


def test_a_mask_of_who_hides_a_person_is_theirs() -> None:
    """A person half behind another one is asked for, and then nobody, or the other one, too."""
    there = {'behind': np.s_[10:110, 10:50], 'before': np.s_[10:110, 30:70]}
    shown = {**there, 'both': np.s_[10:110, 20:60], 'nobody': np.s_[:0, :0]}

    def given(*drawn: str) -> dict[str, str]:
        """Return what of these masks those who are asked for in turn are given last."""

        def track(name: str, masked_ns: int) -> Mock:
            rows, columns = there[name]
            box = Box(columns.start, rows.start, 40, 100)
            expected = np.full((100, 40), 255, np.uint8)
            who = Mock(slot=0, masked_ns=masked_ns, box=box, window=there[name])
            who.configure_mock(**{'view.scale': 1.0, 'expected_mask.return_value': expected})

            def take(mask: SoftMask | None, box: Box) -> None:
                who.masked_ns, who.taken = S, next((k for k, v in masks.items() if v is mask), '')

            who.take_mask, who.taken = take, 'none yet'
            return who

        masks = {name: mask_of(part) for name, part in shown.items()}
        people = {name: track(name, age) for age, name in enumerate(there)}
        draw_known(lambda boxes: [masks[name] for name in drawn], people.values(), S)
        return {name: who.taken for name, who in people.items()}

    assert given('behind') == {'behind': 'behind', 'before': 'none yet'}
    assert given('before') == {'behind': '', 'before': 'before'}
    assert given('before', 'both') == {'behind': '', 'before': 'both'}
    # As much of the one as of the other, and of neither.
    assert given('both') == {'behind': 'both', 'before': 'none yet'}
    assert given('nobody') == {'behind': 'nobody', 'before': 'none yet'}

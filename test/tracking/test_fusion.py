# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What masks teach: all of a person, and part of one."""

import cv2
import numpy as np
import pytest

from gait_segmentation.detector.detection import SoftMask
from gait_segmentation.geometry import Box
from gait_segmentation.images import placed
from gait_segmentation.results import Feedback
from gait_segmentation.tracking.fusion import grown
from gait_segmentation.tracking.people import next_state
from test.tracking.figures import HEIGHT, STEP_NS, WIDTH, Figure, Told, picture, walk

BOARD = (130, 320)
"""It reaches to the border: who walks behind it comes back."""


@pytest.mark.parametrize(('late', 'pan'), [(0, 0), (0, 2), (4, 0), (4, 2), (8, 0)])
def test_a_mask_says_where_somebody_was_in_its_frame_however_late_it_comes(
    late: int, pan: int
) -> None:
    """They go one way and back, seen by a camera that stands or turns."""
    told = Told(late=late)
    path = [*walk(Figure(70), 20, 4.0), *walk(Figure(142), 20, -4.0)]
    told.start(path[0])
    for number, figure in enumerate(path):
        (result,) = told.show(figure, shift=(pan * number, 0))
        if number > 8:
            assert result.body.center_x == pytest.approx(figure.x + 0.5 + pan * number, abs=1.5)
            assert result.body.center_y == pytest.approx(figure.y + 3, abs=1.5)
        if number % 20 > 15:
            (track,) = told.tracker.tracks()
            # In pixels a second against the world.
            assert track.pose.velocity[0] * (1 if number < 20 else -1) > 60


def test_who_is_smaller_from_now_on_is_all_of_a_person_after_a_while() -> None:
    """Of a mask that is too small nothing is learnt, until it was so for a second and a half."""
    told, figure, colours = Told(), Figure(100), []
    told.start(figure)
    for number in range(75):
        image, (mask,) = picture([figure])
        mask[100:] = 0 if number >= 5 else mask[100:]
        told.see(image, [mask], [figure.mask()])
        (track,) = told.tracker.tracks()
        colours.append(track.colours.person.table.tobytes())
    assert [len(set(part)) for part in (colours[:5], colours[5:25])] == [5, 1]
    assert len(set(colours[-10:])) == 10


def test_what_a_network_has_drawn_counts_for_a_while_and_goes_along() -> None:
    """Somebody walks, and once a network has drawn a bag beside them."""

    def judged(bag: bool) -> list[float]:
        """Return by frames what is made of the pixels where the bag is."""
        told, path, found = Told(use_sightings=False), walk(Figure(60), 14), []
        told.start(path[0])
        for number, figure in enumerate(path):
            told.show(figure)
            (track,) = told.tracker.tracks()
            x = round(figure.x)
            if number == 4:
                values = figure.mask()
                values[80:100, x : x + 30] = 255 if bag else 0
                whole = Box(0, 0, WIDTH, HEIGHT)
                track.take_mask(SoftMask(values, 1.0, (0.0, 0.0), whole), figure.box)
            claim = track.claim()
            at = (86 - claim.window[0].start, x + 22 - claim.window[1].start)
            found.append(float(claim.logit[at]))
        return found

    more = np.subtract(judged(True), judged(False))
    # Less in each frame, up to heat_map_age: that is five of them.
    assert (more[4:8] > 1.5).all()
    np.testing.assert_allclose([*more[:4], *more[10:]], 0, atol=0.5)


def test_half_a_body_teaches_neither_colours_nor_size_but_is_followed() -> None:
    """Somebody goes half behind a board, turns there, and comes back."""
    inward = np.arange(60.0, 128.0, 2.0)
    path = [Figure(x) for x in (*inward, *[128.0] * 10, *np.arange(127.0, 70.0, -1.5))]
    told, colours, heights = Told(), [], []
    told.start(path[0])
    for number, figure in enumerate(path):
        (result,) = told.show(figure, boards=[BOARD])
        (track,) = told.tracker.tracks()
        colours.append(hash(track.colours.person.table.tobytes()))
        heights.append(track.body.height)
        if number >= 10:
            assert result.state == 'tracked'
            assert result.body.center_x == pytest.approx(figure.x, abs=9)
    half = [k for k, figure in enumerate(path) if figure.x >= 126]
    assert len({colours[k] for k in half}) <= 2
    assert np.ptp([heights[k] for k in half]) < 2
    # Afterwards the size is as before, and learning goes on.
    assert heights[-1] == pytest.approx(path[-1].height, abs=6)
    assert len(set(colours[-10:])) == 10


@pytest.mark.parametrize('alone', [True, False])
def test_a_part_of_somebody_who_is_not_alone_tells_nothing_of_the_background(alone: bool) -> None:
    told = Told()
    told.follow([Figure(60)] * 2)
    told.tracker.update(picture([Figure(60)])[0], told.stamp_ns)
    (track,) = told.tracker.tracks()
    half = Figure(60).mask()
    half[:, 60:] = 0
    feedback = Feedback(told.stamp_ns, track.track_id, half, None, Figure(60).mask())
    taught = track.correct(track.history.states[-1], feedback, alone=alone)
    assert (taught is not None) == alone


SMALL = (60, 80)


def block(left: int, top: int, right: int, bottom: int) -> np.ndarray:
    mask = np.zeros(SMALL, np.uint8)
    mask[top:bottom, left:right] = 255
    return mask


def test_the_margin_is_a_share_of_the_height() -> None:
    mask = block(20, 10, 40, 50)
    window, part = grown(mask, 100)
    margin = placed(part, window, SMALL)
    assert np.flatnonzero(margin[30]).tolist() == list(range(18, 42))
    assert margin.any(axis=1).sum() == 44
    assert not grown(np.zeros(SMALL, np.uint8), 100)[1].any()


def test_a_first_mask_far_too_large_does_not_keep_others_out_for_ever() -> None:
    told, figure = Told(), Figure(60)
    told.tracker.initialize(figure.box.padded(12, 0))
    for _ in range(40):
        told.show(figure)
    (track,) = told.tracker.tracks()
    assert track.body.width < figure.box.width + 8


def test_a_mask_of_who_was_lost_meanwhile_teaches_nothing() -> None:
    told = Told()
    told.follow([Figure(60)] * 2)
    told.tracker.update(picture([Figure(60)])[0], told.stamp_ns)
    (track,) = told.tracker.tracks()
    mask = Figure(60).mask()
    track.enter('lost', 'as the test says')
    feedback = Feedback(told.stamp_ns, track.track_id, mask, None, mask)
    assert track.correct(track.history.states[-1], feedback, alone=True) is None
    assert track.template is None


def test_what_looks_like_the_place_about_the_template_is_no_colour_of_the_person() -> None:
    def colours(size: int, template: int = 1) -> np.ndarray:
        """Follow somebody and give a last mask and template, each widened by so much."""
        told = Told()
        told.follow(walk(Figure(40), 20))
        image, (mask,) = picture([Figure(97)])
        widened = [cv2.dilate(mask, np.ones((each, each), np.uint8)) for each in (size, template)]
        told.see(image, widened[:1], widened[1:])
        (track,) = told.tracker.tracks()
        return track.colours.person.table

    true = colours(1)
    np.testing.assert_allclose(colours(7), true, atol=1e-4)
    # Inside of the template they may wear what the wall is painted with.
    assert np.abs(colours(7, template=7) - true).max() > 1e-3


def test_it_is_known_when_somebody_was_drawn_last() -> None:
    told, figure = Told(), Figure(100)
    told.start(figure)
    for number in range(3):
        told.show(figure)
        (track,) = told.tracker.tracks()
        whole = Box(0, 0, WIDTH, HEIGHT)
        track.take_mask(SoftMask(figure.mask(), 1.0, (0.0, 0.0), whole), figure.box)
        assert track.masked_ns == (number + 1) * STEP_NS


@pytest.mark.parametrize('moved', [False, True])
def test_a_mask_tells_what_was_learnt_of_the_place_only_of_who_never_moved(moved: bool) -> None:
    told, figure = Told(), Figure(100)
    told.start(figure)
    for _ in range(10):
        told.show(figure)
    (track,) = told.tracker.tracks()
    if moved:
        track.existence = track.existence.moving(told.stamp_ns, 1.0)
    known, values = track.view.background.count.copy(), figure.mask()
    values[60:100, 130:150] = 255
    whole = Box(0, 0, WIDTH, HEIGHT)
    track.take_mask(SoftMask(values, 1.0, (0.0, 0.0), whole), figure.box)
    assert (track.view.background.count == known).all() == moved


def test_how_much_of_a_person_moves_is_taken_in() -> None:
    told, figure = Told(), Figure(100)
    told.start(figure)
    for number in range(12):
        told.show(Figure(100, stride=0.1 + 0.01 * (number % 3)))
    (track,) = told.tracker.tracks()
    assert 0 < track.existence.motion < 1


def test_who_was_found_again_is_lost_anew_only_after_as_many_frames() -> None:
    told, figure = Told(), Figure(100)
    told.start(figure)
    told.show(figure)
    (track,) = told.tracker.tracks()
    for _ in range(2):
        for _ in range(2):
            assert (track.state, next_state(track, told.stamp_ns)[0]) == ('tracked', 'tracked')
            track.miss()
        track.enter(*next_state(track, told.stamp_ns))
        assert track.state == 'lost'
        track.enter('tracked', '')

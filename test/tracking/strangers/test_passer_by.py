# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One passer-by: followed from frame to frame."""

from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.ego_motion.world_motion import WorldMotion
from gait_segmentation.tracking.background.model import BackgroundModel
from gait_segmentation.tracking.competition import Claim
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.nearness import nearness
from gait_segmentation.tracking.outline import Outline
from gait_segmentation.tracking.person.person import new_colours
from gait_segmentation.tracking.picture.working import WorkingImage
from gait_segmentation.tracking.records import Record
from gait_segmentation.tracking.strangers.beside import Beside
from gait_segmentation.tracking.strangers.passer_by import PasserBy
from test.tracking.figures import BLUE, HEIGHT, STEP_NS, WIDTH, Figure, picture, wall

STILL = WorldMotion()


def frame(figure: Figure, number: int) -> Record:
    image, _ = picture([figure])
    shape = (HEIGHT, WIDTH)
    working = WorkingImage.of(image, (number + 1) * STEP_NS, shape)
    return Record(working, STILL, BackgroundModel(shape), 0, [])


def passer_by(figure: Figure) -> PasserBy:
    outline = Outline.of(np.ascontiguousarray(figure.mask()[::2, ::2]))
    colours = new_colours(TrackingConfig())[0]
    return PasserBy(
        -1, figure.x, figure.y, figure.height, outline, colours, STEP_NS, usual_area=outline.area
    )


def walked(speed: float, frames: int) -> PasserBy:
    figures = [Figure(100 + speed * number, BLUE) for number in range(frames)]
    other = passer_by(figures[0])
    records = [frame(figure, number) for number, figure in enumerate(figures)]
    for number in range(1, frames):
        pending = records[1:number]
        other.follow(STILL, records[number - 1], records[number], other.expected(pending))
    return other


def test_somebody_is_followed_by_how_they_look() -> None:
    other = walked(4.0, 8)
    assert other.center_x == pytest.approx(128, abs=3)
    assert other.center_y == pytest.approx(90, abs=2)
    assert other.velocity[0] == pytest.approx(4, abs=1)


def test_who_goes_is_proven_and_what_stays_is_still() -> None:
    gone, stayed = walked(4.0, 8), walked(0.0, 8)
    assert gone.proven
    assert not gone.still
    assert stayed.still
    assert not stayed.proven


@pytest.mark.parametrize(('gap', 'learnt'), [(60, True), (26, False)])
def test_colours_are_learnt_while_most_of_somebody_is_clear_of_who_is_tracked(
    gap: int, learnt: bool
) -> None:
    other = passer_by(Figure(100, BLUE))
    nothing, tracked = np.zeros((HEIGHT, WIDTH), np.uint8), Figure(100 + gap).mask()
    record = frame(Figure(100, BLUE), 0)
    record.bodies[-1] = (0.0, 0.0)
    record.passers_by[-1] = other.outline
    beside = Beside(record, nothing, None)
    beside.add((slice(0, HEIGHT), slice(0, WIDTH)), nothing, nothing, tracked)
    before = other.colours.table.copy()
    assert other.learn(beside, [])
    assert other.well_seen
    assert (other.colours.table != before).any() == learnt


def test_somebody_hardly_seen_goes_on_at_the_last_pace() -> None:
    figures = [Figure(100, BLUE), Figure(150, BLUE)]
    other = passer_by(figures[0])
    other.velocity, other.well_seen, other.followed = (3.0, 1.0), False, True
    last, now = (frame(figure, number) for number, figure in enumerate(figures))
    other.follow(STILL, last, now, other.outline)
    assert now.bodies == {-1: (3.0, 1.0)}
    assert (other.center_x, other.center_y) == (103.0, 91.0)


def test_nobody_claims_pixels_before_having_gone_some_way() -> None:
    figure = Figure(100, BLUE)
    other = passer_by(figure)
    assert other.claim(frame(figure, 0), other.outline, [], TrackingConfig()) is None


def test_a_wall_that_is_known_is_not_won_about_somebody() -> None:
    figure = Figure(100, BLUE)
    other, mask, beside = passer_by(figure), figure.mask(), {}
    logit = np.full(mask.shape, 5, np.float32)
    everywhere = (slice(0, HEIGHT), slice(0, WIDTH))
    claim = Claim(everywhere, logit, mask, nearness(mask, 100.0), 0.0, 100.0, known=False)
    for known in (False, True):
        record = frame(figure, 0)
        if known:
            lab = WorkingImage.of(wall(), 1, mask.shape).lab
            for _ in range(5):
                record.background.learn(lab, np.zeros_like(mask))
        won = other.won(record, claim, logit, 0.7).enlarged(everywhere) > 0
        assert won[mask > 0].mean() > 0.9
        beside[known] = np.count_nonzero(won & (mask == 0))
    assert beside[True] < 0.1 * beside[False]


def test_who_left_the_image_is_forgotten_in_time() -> None:
    figure = Figure(100, BLUE)
    other = passer_by(figure)
    other.outline = other.outline.shifted(2 * WIDTH, 0)
    kept = []
    for number in range(40):
        record = frame(figure, number)
        record.bodies[-1] = (0.0, 0.0)
        beside = Beside(record, np.zeros((HEIGHT, WIDTH), np.uint8), None)
        assert other.claim(record, other.outline, [], TrackingConfig()) is None
        kept.append(other.learn(beside, []))
    assert kept[0]
    assert not kept[-1]
    assert not other.well_seen


@pytest.mark.parametrize('where', ['in their place', 'apart'])
def test_who_is_only_seen_in_the_place_of_who_is_tracked_is_forgotten(where: str) -> None:
    figure = Figure(100, BLUE)
    other = passer_by(figure)
    tracked = figure if where == 'in their place' else Figure(180, BLUE)
    nothing = np.zeros((HEIGHT, WIDTH), np.uint8)
    all_of_it = (slice(0, HEIGHT), slice(0, WIDTH))
    kept = []
    for number in range(40):
        record = frame(figure, number)
        record.bodies[-1] = (0.0, 0.0)
        # It goes on winning pixels of the figure, which the mask of who is tracked thus lacks.
        record.passers_by[-1] = other.outline
        beside = Beside(record, nothing, None)
        beside.add(all_of_it, nothing, nothing, tracked.mask())
        kept.append(other.learn(beside, []))
    assert kept[0]
    assert kept[-1] == (where == 'apart')

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What somebody watched must show to be taken for a walker."""

from __future__ import annotations

import numpy as np

from gait_segmentation.gait_model import render_silhouette
from gait_segmentation.geometry import Box
from gait_segmentation.starting import StartingConfig
from gait_segmentation.starting.finding.candidates import Candidate
from gait_segmentation.starting.finding.watch import Watch, light_bank
from test.walkers import small_bank

PERIOD = 0.04
HEIGHT = 80.0


def watched(
    *,
    speed: float = 3.0,
    top: int = 20,
    left: int = 20,
    wider: float = 1.0,
    frames: int = 30,
    **changes: float,
) -> list[Box]:
    """Return where a silhouette that walks to the right is found, in which row it may begin."""
    watch, found = None, []
    config = StartingConfig(**changes)
    for number in range(frames):
        drawn = render_silhouette(0.95 * PERIOD * number, 0.0, HEIGHT)
        likelihood = np.zeros((300, 500), np.uint8)
        x = round(150 + left + speed * number)
        likelihood[100 + top : 100 + top + drawn.shape[0], x : x + drawn.shape[1]] = drawn
        likelihood = np.ascontiguousarray(likelihood[100:220, 150:390])
        around = Box.around(likelihood > 127)
        assert around is not None
        seconds = 1 + PERIOD * number
        box = Box.from_center(
            around.center_x, around.center_y, wider * around.width, around.height
        )
        if watch is None:
            candidate = Candidate(1, box, seconds, seconds)
            watch = Watch(light_bank(small_bank()), config, candidate)
        candidate.box, candidate.seen = box, seconds
        candidate.note(seconds, (0.0, 0.0))
        if watch.due(seconds):
            place = watch.update(likelihood, candidate, round(1e9 * seconds))
            found += [] if place is None else [place]
    return found


def test_a_walker_is_found_with_a_tight_box() -> None:
    box = watched()[0]
    assert abs(box.height - HEIGHT) < 6


def test_who_stays_in_place_is_not_found_though_the_legs_move() -> None:
    assert watched(speed=0.0) == []
    assert watched(speed=0.0, least_way=0.0)


def test_what_is_far_wider_than_a_body_is_nobody() -> None:
    assert watched(wider=4.0) == []


def test_who_is_cut_off_by_the_border_is_waited_for() -> None:
    assert watched(top=-35) == []
    assert watched(top=60) == []

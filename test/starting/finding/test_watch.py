# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What somebody watched must show to be taken for a walker."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np
import pytest

from gait_segmentation.geometry import Box
from gait_segmentation.starting import StartingConfig
from gait_segmentation.starting.finding.candidates import Candidate
from gait_segmentation.starting.finding.watch import Watch, light_bank
from gait_tools.gait_model import render_silhouette
from test.walkers import small_bank

PERIOD = 0.04
TALL = 90


def shown(shape: np.ndarray) -> np.ndarray:
    """Return (120, 160) uint8 with a silhouette in the middle."""
    out = np.zeros((120, 160), np.uint8)
    out[15 : 15 + shape.shape[0], 80 - shape.shape[1] // 2 :][:, : shape.shape[1]] = shape
    return out


def walking(seconds: float) -> np.ndarray:
    return shown(render_silhouette(0.9 * seconds % 1, 0.0, TALL))


def swinging(seconds: float) -> np.ndarray:
    """Return a figure that hangs on its head."""
    turn = cv2.getRotationMatrix2D((80.0, 15.0), 12 * np.sin(2 * np.pi * 0.9 * seconds), 1.0)
    figure = shown(render_silhouette(0.25, 0.0, TALL))
    return np.asarray(cv2.warpAffine(figure, turn, (160, 120)))


def growing(seconds: float) -> np.ndarray:
    """Return a figure that becomes broader and thinner as a whole."""
    broad = 1 + 0.4 * np.sin(2 * np.pi * 0.9 * seconds)
    figure = shown(render_silhouette(0.0, 0.0, TALL))
    move = np.array([[broad, 0, 80 - 80 * broad], [0, 1.0, 0]])
    return np.asarray(cv2.warpAffine(figure, move, (160, 120)))


def rolling(seconds: float) -> np.ndarray:
    """Return a box."""
    return shown(np.full((TALL, 40), 255, np.uint8))


def watched(
    look: Callable[[float], np.ndarray],
    way: float = 0.8,
    trunk: float = 0.0,
    seconds: float = 2.0,
    wider: float = 1.0,
) -> tuple[float | None, Watch]:
    """
    Watch a figure that stays where it is in the picture.

    :param way: what it goes in body heights a second, as if the camera went with it.
    :param trunk: by how much its trunk flickers.
    :returns: after how many seconds it is found to walk, None if it is not; and the watch.
    """
    rng = np.random.default_rng(1)
    watch: Watch | None = None
    candidate: Candidate | None = None
    for number in range(round(seconds / PERIOD)):
        now = 1 + number * PERIOD
        likelihood = look(number * PERIOD)
        patches = rng.uniform(size=(8, 10)) < trunk
        flicker = cv2.resize(patches.astype(np.uint8), (160, 40), interpolation=cv2.INTER_NEAREST)
        likelihood[35:60, 60:100] ^= 255 * flicker[:25, 60:100]
        box = Box.around(likelihood > 127)
        assert box is not None
        box = Box.from_center(box.center_x, box.center_y, wider * box.width, box.height)
        if candidate is None or watch is None:
            candidate = Candidate(1, box, now, now)
            watch = Watch(light_bank(small_bank()), candidate, likelihood)
        candidate.box, candidate.seen = box, now
        candidate.way.append((now, number * way * TALL * PERIOD, 0.0, float(TALL)))
        if watch.due(now):
            watch.update(likelihood, candidate, round(1e9 * now))
            if watch.walks(candidate, StartingConfig()):
                return now - 1, watch
    assert watch is not None
    return None, watch


def test_a_walker_is_found_soon_with_a_tight_box() -> None:
    found, watch = watched(walking)
    assert found is not None
    assert found < 0.6
    assert watch.box is not None
    assert abs(watch.box.height - TALL) < 6


def test_a_box_that_comes_along_is_not_found() -> None:
    assert watched(rolling)[0] is None


@pytest.mark.parametrize('look', [swinging, growing])
def test_what_swings_or_grows_on_the_spot_is_not_found(
    look: Callable[[float], np.ndarray],
) -> None:
    assert watched(look, way=0.08)[0] is None


def test_some_way_must_be_seen() -> None:
    assert watched(walking, way=0.0)[0] is None


def test_what_is_far_wider_than_a_body_is_less_sure_to_walk() -> None:
    (soon, usual), (late, wide) = watched(walking), watched(walking, wider=4.0)
    assert soon is not None
    assert late is None or (late, -wide.evidence) > (soon, -usual.evidence)


def test_the_trunk_may_flicker() -> None:
    assert watched(walking, trunk=0.2)[0] is not None


def test_evidence_never_falls_below_zero() -> None:
    assert watched(rolling)[1].evidence == 0

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import cv2
import numpy as np
import pytest

from gait_segmentation.geometry import Box
from gait_segmentation.tracking.cues.heat_map import HeatMapCue

SHAPE = (120, 160)
WINDOW = (slice(10, 110), slice(30, 130))
HEIGHT = 72.0


def body(dx: int = 0, dy: int = 0) -> np.ndarray:
    """Return somebody of 72 pixels: a head, a trunk and a leg put forward."""
    mask = np.zeros(SHAPE, np.uint8)
    for top, bottom, left, right in ((24, 36, 74, 86), (36, 66, 70, 90), (66, 96, 66, 78)):
        mask[top + dy : bottom + dy, left + dx : right + dx] = 255
    mask[66 + dy : 96 + dy, 84 + dx : 96 + dx] = 255
    return mask


BOX = Box(66, 24, 30, 72)


def seated(heat: np.ndarray) -> HeatMapCue:
    """Return what is known of a map that was laid on the person."""
    cue = HeatMapCue()
    cue.place(heat, WINDOW, body()[WINDOW].astype(np.float32) / 255, HEIGHT)
    return cue


NOISE = np.random.default_rng(0).integers(0, 256, SHAPE, np.uint8)


@pytest.mark.parametrize('taught', ['box', 'mask'])
@pytest.mark.parametrize(
    ('heat', 'tells'),
    [
        (body(), True),
        (255 - body(), True),
        ((0.4 * body() + 60).astype(np.uint8), True),
        (np.full(SHAPE, 200, np.uint8), False),
        (np.zeros(SHAPE, np.uint8), False),
        (NOISE, False),
    ],
    ids=['good', 'inverted', 'soft', 'constant', 'empty', 'noise'],
)
def test_a_map_that_tells_the_person_counts_whatever_its_values_are(heat, tells, taught):
    cue = seated(heat)
    if taught == 'box':
        cue.begin(heat, BOX, WINDOW)
    else:
        cue.calibrate(heat[WINDOW], body()[WINDOW])
    found, person = cue.evidence_of(cue.part(heat, WINDOW)), body()[WINDOW] > 0
    if tells:
        assert found[person].mean() > 3
        assert found[~person].mean() < -2
    else:
        assert np.abs(found).max() < 0.5


def test_masks_that_the_map_does_not_agree_with_teach_nothing():
    cue = seated(body())
    cue.calibrate(body()[WINDOW], body()[WINDOW])
    known, wrong = cue.evidence_of(body()[WINDOW]), 255 - body()[WINDOW][::-1]
    for _ in range(10):
        cue.place(body(), WINDOW, (wrong > 0).astype(np.float32), HEIGHT)
        cue.calibrate(body()[WINDOW], wrong)
    assert np.ptp(known) > 6
    assert 0.7 < cue.weight < 1
    np.testing.assert_allclose(
        cue.evidence_of(body()[WINDOW]), np.float32(cue.weight) * known, rtol=1e-5
    )


def test_the_first_masks_tell_at_once_what_a_box_told_wrong():
    cue, beside, told = seated(body()), body()[WINDOW] == 0, []
    cue.begin(body(), Box(40, 10, 84, 90), WINDOW)
    for _ in range(4):
        told.append(float(cue.evidence_of(cue.part(body(), WINDOW))[beside].mean()))
        cue.calibrate(body()[WINDOW], body()[WINDOW])
    assert told[0] > -2
    assert told[-1] < told[0] - 0.5


@pytest.mark.parametrize('off', [(0, 0), (9, 0), (-36, 0), (4, -12), (-7, 20)])
def test_a_map_that_is_off_is_put_right(off):
    cue, heat = HeatMapCue(), body(*off)
    likely = body()[WINDOW].astype(np.float32) / 255
    for _ in range(3):
        cue.place(heat, WINDOW, likely, HEIGHT)
    part = cue.part(heat, WINDOW) > 127
    there = body()[WINDOW] > 127
    assert (part & there).sum() / (part | there).sum() > 0.9


def test_a_map_that_correlates_little_counts_nothing_whatever_was_learnt():
    cue, heat = seated(body()), np.zeros(SHAPE, np.uint8)
    heat[:, :90] = 255
    cue.calibrate(body()[WINDOW], body()[WINDOW])
    assert cue.weight == 1
    for _ in range(60):
        cue.place(heat, WINDOW, body()[WINDOW].astype(np.float32) / 255, HEIGHT)
    assert cue.weight == 0
    assert not cue.evidence_of(cue.part(heat, WINDOW)).any()


def test_a_body_of_a_tenth_of_a_pixel_makes_no_huge_image(monkeypatch):
    sizes = []
    match = cv2.matchTemplate
    monkeypatch.setattr(cv2, 'matchTemplate', lambda *a: sizes.append(a[0].size) or match(*a))
    HeatMapCue().place(body(), WINDOW, body()[WINDOW].astype(np.float32) / 255, 0.1)
    assert sizes == [130 * 130]


def test_an_old_map_is_carried_along():
    cue = HeatMapCue()
    likely = body(8, 3)[WINDOW].astype(np.float32) / 255
    cue.place(body(), WINDOW, likely, HEIGHT, (8.0, 3.0))
    assert (cue.part(body(), WINDOW, (8.0, 3.0)) == body(8, 3)[WINDOW]).all()


@pytest.mark.parametrize('heat', [np.zeros(SHAPE, np.uint8), np.full(SHAPE, 255, np.uint8)])
def test_a_map_without_an_edge_has_no_place(heat):
    cue = HeatMapCue()
    cue.place(heat, WINDOW, np.zeros(SHAPE, np.float32)[WINDOW], HEIGHT)
    cue.place(heat, (slice(0, 1), slice(0, 1)), np.zeros((1, 1), np.float32), 500.0)
    assert np.shares_memory(cue.part(heat, WINDOW), heat)

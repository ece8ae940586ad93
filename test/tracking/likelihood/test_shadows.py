# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import math

import numpy as np

from gait_segmentation.geometry import BodyFrame
from gait_segmentation.tracking.background.model import BackgroundModel
from gait_segmentation.tracking.likelihood.backdrop import Backdrop
from gait_segmentation.tracking.likelihood.shadows import ShadowModel

from .plain import ALL, BODY, PERSON, SHAPE, background_of, body, looks, plain

GROUND, SHIRT = (200, 132, 138), (50, 120, 150)
TINT = 2
SHADE = (slice(95, 120), slice(90, 125))
ELSEWHERE = (slice(20, 45), slice(100, 135))


def shaded(share: float, tint: int = TINT) -> tuple[int, int, int]:
    """Return the ground in a shadow that leaves a share of L + 16."""
    light, a, b = GROUND
    return (
        round(share * (light + 40.8) - 40.8),
        round(share * (a - 128)) + 128,
        round(share * (b - 128)) + 128 + tint,
    )


def picture(shade: tuple[int, int, int] | None = None) -> np.ndarray:
    return plain(GROUND, SHIRT, shade, SHADE)


def ground() -> BackgroundModel:
    model = background_of(GROUND)
    model.sigma = 3.0
    return model


def backdrop(lab: np.ndarray) -> Backdrop:
    return Backdrop(lab, ALL, ground(), textured=False)


def learnt(lab: np.ndarray, *, masks: int = 20, strange: np.ndarray | None = None) -> ShadowModel:
    model = ShadowModel()
    strange = np.zeros(SHAPE, np.uint8) if strange is None else strange
    for _ in range(masks):
        model.learn(backdrop(lab), PERSON, body(), body(), strange)
    return model


def weighed(model: ShadowModel, lab: np.ndarray, ratio: float = 2.0) -> np.ndarray:
    """Return log-likelihood ratios that were all the same, the person having all colours."""
    logit = np.full(SHAPE, ratio, np.float32)
    model.weigh(logit, backdrop(lab), PERSON, *looks(lab), 0.95)
    return logit


def test_knows_of_no_shadows_at_first() -> None:
    assert (weighed(ShadowModel(), picture(shaded(0.85))) == 2.0).all()


def test_a_shadow_that_is_seen_is_no_longer_the_person() -> None:
    lab = picture(shaded(0.85))
    logit = weighed(learnt(lab), lab)
    assert logit[SHADE].mean() < 0.0
    assert logit[SHADE].min() >= -1.0
    assert (logit[BODY] == 2.0).all()
    assert (logit[:90, :60] == 2.0).all()


def test_ratios_follow_the_formula() -> None:
    lab = picture(shaded(0.85))
    model = learnt(lab)
    ratio = (float(shaded(0.85)[0]) + 40.8) / 240.8
    depth = int((ratio - 0.75) / 0.05)
    a = int((shaded(0.85)[1] - 128 - ratio * 4) / 3 + 2.5)
    b = int((shaded(0.85)[2] - 128 - ratio * 10) / 3 + 2.5)
    row, column = 100, 100
    place = int((row + 0.5 - 10) / 10), int((column + 0.5 - 80) / 10 + 8)
    volume = (256 / 24) ** 3 / (0.05 * 3 * 3 * 240.8)
    shadow = 0.95 * 5 / 5.1 * model.share[place] * model.density[depth, a, b] * volume
    wanted = max(2.0 - math.log(1 + shadow / 0.05 * math.exp(2.0)), -1.0)
    assert abs(weighed(model, lab)[row, column] - wanted) < 1e-3


def test_shadows_lie_where_they_were_seen() -> None:
    lab = picture(shaded(0.85))
    model = learnt(lab)
    lab[ELSEWHERE] = shaded(0.85)
    assert weighed(model, lab)[ELSEWHERE].min() > 1.9


def test_shadows_look_as_they_were_seen() -> None:
    model = learnt(picture(shaded(0.9)))
    for other in (shaded(0.78), shaded(0.9, tint=-6)):
        assert weighed(model, picture(other))[SHADE].min() > 1.9


def test_what_is_deep_or_of_another_hue_is_not_learnt() -> None:
    for other in (shaded(0.7), shaded(0.85, tint=10), (230, 132, 138)):
        assert not learnt(picture(other)).density.any()


def test_what_lies_beside_something_strange_is_not_learnt() -> None:
    lab, strange = picture(shaded(0.85)), np.zeros(SHAPE, np.uint8)
    strange[SHADE[0], 106:109] = 1
    kept = learnt(lab).share.sum()
    assert learnt(lab, strange=strange).share.sum() < 0.75 * kept
    strange[SHADE] = 1
    assert not learnt(lab, strange=strange).share.any()


def test_the_person_is_not_learnt() -> None:
    lab = picture()
    lab[BODY] = shaded(0.85)
    assert not learnt(lab).share.any()


def test_shadows_that_are_gone_are_forgotten() -> None:
    model = learnt(picture(shaded(0.85)))
    before, nobody = model.share.max(), np.zeros(SHAPE, np.uint8)
    for _ in range(240):
        model.learn(backdrop(picture()), PERSON, nobody, nobody, nobody)
    assert model.share.max() < 0.1 * before


def test_somebody_at_the_border_teaches_what_is_in_the_image() -> None:
    lab = picture(shaded(0.85))
    part = (slice(90, 130), slice(90, 160))
    nobody, strange = np.zeros(SHAPE, np.uint8), np.zeros((40, 70), np.uint8)
    model = ShadowModel()
    for _ in range(4):
        seen = Backdrop(np.ascontiguousarray(lab[part]), part, ground(), textured=False)
        model.learn(seen, BodyFrame(150.0, 45.0, 100.0), nobody, nobody, strange)
    assert model.share.any()
    assert np.isfinite(model.share).all()

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import math

import numpy as np
import pytest

from gait_segmentation.geometry import BodyFrame
from gait_segmentation.pipeline import Pipeline, PipelineConfig
from gait_segmentation.tracking import TrackingConfig
from gait_segmentation.tracking.likelihood.backdrop import Backdrop
from gait_segmentation.tracking.likelihood.hard_shadows import HardShadowModel
from test.walkers import box_of, overlap, small_bank, sunlit

from .plain import ALL, BODY, PERSON, SHAPE, background_of, body, looks, plain

GROUND, SHIRT = (200, 130, 134), (120, 150, 160)
SHADE = (slice(90, 120), slice(97, 140))
"""Of which the first columns are too near to the body to be told."""
FAR = (slice(90, 120), slice(100, 140))
STRANGERS = (slice(50, 70), slice(20, 50))
ABOVE = (slice(10, 35), slice(100, 140))


def shaded(share: float = 0.45, tint: float = -0.05) -> tuple[int, int, int]:
    """Return the ground in a shadow that leaves a share of L + 16, the rest having a tint."""
    light, a, b = GROUND
    lost = (1 - share) * (light + 40.8)
    return (
        round(share * (light + 40.8) - 40.8),
        round(share * (a - 128) - tint * lost) + 128,
        round(share * (b - 128) + tint * lost) + 128,
    )


def picture(shade: tuple[int, int, int] | None = None) -> np.ndarray:
    return plain(GROUND, SHIRT, shade, SHADE)


def backdrop(lab: np.ndarray, *, times: float = 5.0, textured: bool = False) -> Backdrop:
    return Backdrop(lab, ALL, background_of(GROUND, times), textured)


def learnt(
    lab: np.ndarray,
    *,
    masks: int = 10,
    mask: np.ndarray | None = None,
    times: float = 5.0,
    company: bool = False,
) -> HardShadowModel:
    model, behind = HardShadowModel(), backdrop(lab, times=times)
    for _ in range(masks):
        model.learn(behind, PERSON, body() if mask is None else mask, body(), company=company)
    return model


def weighed(model: HardShadowModel, behind: Backdrop, ratio: float = 2.0) -> np.ndarray:
    """Return log-likelihood ratios that were all the same, the person having all colours."""
    logit = np.full(SHAPE, ratio, np.float32)
    model.weigh(logit, behind, PERSON, body(), *looks(behind.lab), 0.95)
    return logit


def test_knows_of_no_shadows_at_first() -> None:
    lab = picture(shaded())
    model = HardShadowModel()
    assert model.known is None
    assert (weighed(model, backdrop(lab)) == 2.0).all()


def test_a_shadow_that_is_seen_is_no_longer_the_person() -> None:
    lab = picture(shaded())
    logit = weighed(learnt(lab), backdrop(lab))
    assert logit[FAR].max() < 0.0
    assert logit[FAR].min() >= -4.0
    assert (logit[BODY] == 2.0).all()
    assert (logit[:, :60] == 2.0).all()


def test_the_look_is_measured() -> None:
    look = learnt(picture(shaded(0.45, tint=-0.05))).known
    assert look is not None
    assert look.ratio == pytest.approx((0.45, 0.0), abs=0.01)
    assert look.tint_a == pytest.approx((0.05, 0.0), abs=0.01)
    assert look.tint_b == pytest.approx((-0.05, 0.0), abs=0.01)


def test_ratios_follow_the_formula() -> None:
    lab = picture(shaded())
    model = learnt(lab)
    seen, row, column = backdrop(lab), 100, 120
    lab[row, column] = shaded(0.4)
    assert model.known is not None
    base = GROUND[0] + 40.8
    ratio = (float(lab[row, column, 0]) + 40.8) / base
    lost = base * (1 - ratio)
    spread = 0.015 * lost + 1.5
    off = (min(ratio - model.known.ratio[0], 0) / 0.05) ** 2
    for axis, (tint, _) in enumerate((model.known.tint_a, model.known.tint_b), 1):
        level = float(lab[row, column, axis]) - 128 - ratio * (GROUND[axis] - 128)
        off += ((level - tint * lost) / spread) ** 2
    density = math.exp(-off / 2) / (2 * math.pi * spread**2 * (0.9 - model.known.ratio[0]) * base)
    place = int((row + 0.5 - 10) / 10), int((column + 0.5 - 80) / 10 + 8)
    shadow = 0.95 * 5 / 5.1 * model.share[place] * density * (256 / 24) ** 3
    wanted = max(2.0 - math.log(1 + shadow / 0.05 * math.exp(2.0)), -4.0)
    assert weighed(model, seen)[row, column] == pytest.approx(wanted, abs=1e-2)


def test_the_shadow_of_somebody_else_is_told_but_not_what_is_above() -> None:
    model = learnt(picture(shaded()))
    lab = picture(shaded())
    lab[STRANGERS] = lab[ABOVE] = shaded()
    logit = weighed(model, backdrop(lab))
    assert logit[STRANGERS].max() < 1.0
    assert (logit[ABOVE] == 2.0).all()


def test_the_rim_of_a_shadow_is_told_with_it_but_nothing_of_another_tint() -> None:
    model = learnt(picture(shaded()))
    assert weighed(model, backdrop(picture(shaded(0.7))))[FAR].max() < 0.0
    assert (weighed(model, backdrop(picture(shaded(0.45, tint=0.1))))[FAR] == 2.0).all()
    assert (weighed(model, backdrop(picture((2, 137, 122))))[FAR] == 2.0).all()


def test_the_body_and_what_is_near_it_stay() -> None:
    lab = picture(shaded())
    model = learnt(lab)
    lab[80:110, 88:97] = shaded()
    assert (weighed(model, backdrop(lab))[80:110, 88:95] == 2.0).all()


@pytest.mark.parametrize(
    'shade', [(0, 131, 131), shaded(0.8), shaded(0.45, tint=0.25), (20, 170, 128), (230, 130, 134)]
)
def test_what_is_no_hard_shadow_is_not_learnt(shade: tuple[int, int, int]) -> None:
    assert learnt(picture(shade)).known is None


def test_clothes_of_many_colours_are_not_learnt() -> None:
    lab = picture(shaded())
    rng = np.random.default_rng(1)
    colours = rng.integers((30, 110, 110), (130, 150, 150), lab[SHADE].shape)
    lab[SHADE] = colours.astype(np.uint8)
    model = learnt(lab)
    assert model.share.any()
    assert model.known is None


def test_where_others_are_near_only_deep_shadows_are_known() -> None:
    assert learnt(picture(shaded(0.45)), company=True).known is not None
    assert learnt(picture(shaded(0.6)), company=True).known is None
    model = learnt(picture(shaded(0.6)))
    assert model.known is not None


def test_little_or_seldom_seen_is_not_known() -> None:
    assert learnt(picture(shaded()), masks=2).known is None
    lab = picture()
    lab[100:104, 100:110] = shaded()
    assert learnt(lab).known is None


def test_only_known_ground_apart_from_the_mask_teaches() -> None:
    lab = picture(shaded())
    mask = body()
    mask[SHADE] = 255
    assert learnt(lab, mask=mask).known is None
    assert learnt(lab, times=0.5).known is None
    lab = picture()
    lab[BODY] = shaded()
    assert not learnt(lab).share.any()


def test_images_without_colour_teach_nothing_and_forget() -> None:
    lab = picture(shaded())
    model = learnt(lab)
    seen = backdrop(lab, textured=True)
    assert (weighed(model, seen) == 2.0).all()
    model.learn(seen, PERSON, body(), body())
    assert model.known is None


def test_shadows_that_are_gone_are_forgotten() -> None:
    model = learnt(picture(shaded()))
    assert model.known is not None
    for _ in range(60):
        model.learn(backdrop(picture()), PERSON, body(), body())
    assert model.known is None
    assert model.share.max() < 0.01


def test_somebody_at_the_border_teaches_what_is_in_the_image() -> None:
    lab, part = picture(shaded()), (slice(80, 130), slice(90, 160))
    model, whole = HardShadowModel(), backdrop(lab).background
    for _ in range(4):
        seen = Backdrop(np.ascontiguousarray(lab[part]), part, whole, textured=False)
        model.learn(seen, BodyFrame(150.0, 45.0, 100.0), np.zeros(SHAPE, np.uint8), body())
    assert model.known is not None
    assert np.isfinite(model.share).all()


def test_the_mask_of_somebody_in_the_sun_leaves_the_shadow_out() -> None:
    frames = sunlit(40)
    scores = {}
    for used in (True, False):
        config = PipelineConfig(tracking=TrackingConfig(use_hard_shadow=used))
        pipeline = Pipeline(config, small_bank())
        pipeline.initialize(box_of(frames[0]))
        late = []
        for number, frame in enumerate(frames):
            (result,) = pipeline.update(frame.image, (number + 1) * 40_000_000)
            segmentation = result.people[0].segmentation
            assert segmentation is not None
            late.append(overlap(segmentation.mask, frame.truths[0]))
        scores[used] = np.mean(late[20:])
    assert scores[True] > 0.95
    assert scores[True] > scores[False] + 0.1

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from gait_segmentation.colour import BANDS, BIN_VOLUME, ColourModel, colour_bins
from gait_segmentation.scene.background import BackgroundModel
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.likelihood import likelihood_image, log_ratio

SHAPE = (20, 30)
WINDOW = (slice(0, 20), slice(0, 30))
RED, GREY, DARK_GREY = (120, 200, 160), (150, 128, 128), (90, 128, 128)


def image(colour: tuple[int, int, int]) -> np.ndarray:
    return np.full((*SHAPE, 3), colour, np.uint8)


def models() -> tuple[ColourModel, ColourModel]:
    person, surroundings = ColourModel(0.7, 1e-4), ColourModel(0.7, 1e-4)
    rows = np.repeat(np.linspace(0, 0.999, 20, dtype=np.float32)[:, None], 30, 1)
    ones = np.ones(SHAPE, np.float32)
    person.learn(colour_bins(image(RED)), rows, ones, 1)
    surroundings.learn(colour_bins(image(GREY)), rows, ones, 1)
    return person, surroundings


def ratio(
    lab: np.ndarray,
    background: BackgroundModel,
    strangers: np.ndarray | None = None,
    **changes: float,
) -> np.ndarray:
    rows = np.repeat(np.linspace(0, 0.999, 20, dtype=np.float32)[:, None], 30, 1)
    config = TrackingConfig(**changes)
    return log_ratio(lab, rows, WINDOW, background, *models(), config, strangers)


def known(colour: tuple[int, int, int]) -> BackgroundModel:
    background = BackgroundModel(SHAPE)
    for _ in range(10):
        background.learn(image(colour), np.zeros(SHAPE, np.uint8))
    return background


def test_colour_alone_decides_and_is_limited() -> None:
    blank = BackgroundModel(SHAPE)
    assert np.all(ratio(image(RED), blank) == 6)
    assert np.all(ratio(image(GREY), blank) == -6)


def test_an_unknown_colour_says_nothing() -> None:
    assert ratio(image((10, 60, 60)), BackgroundModel(SHAPE)) == pytest.approx(0, abs=1e-5)


def test_a_known_background_overrules_the_colours() -> None:
    # The wall is as red as the person, but here it looks as it always did.
    assert ratio(image(RED), known(RED)).max() < 1
    # And a colour of the surroundings where another was known cannot be background.
    assert ratio(image(RED), known(GREY)).min() > 5


def test_a_shadow_at_the_feet_is_background() -> None:
    with_shadow = ratio(image(DARK_GREY), known(GREY))
    without = ratio(image(DARK_GREY), known(GREY), use_shadow=False)
    assert with_shadow[19, 5] < without[19, 5] - 2
    assert with_shadow[2, 5] == pytest.approx(without[2, 5])


def test_the_switch_for_the_background_works() -> None:
    assert np.all(ratio(image(RED), known(RED), use_background=False) == 6)


def test_the_likelihood_image_is_the_sigmoid_in_the_window() -> None:
    logit = np.array([[0.0, 10.0], [-10.0, 1.0]], np.float32)
    window = (slice(1, 3), slice(2, 4))
    result = likelihood_image(logit, window, (4, 5))
    assert result[window].tolist() == [[128, 255], [0, round(255 / (1 + np.exp(-1)))]]
    assert result.sum() == result[window].sum()


def _square_slopes(model: BackgroundModel) -> np.ndarray:
    """Return the squared slopes of lightness and of chroma, zero next to what is unknown."""
    known = model.count >= 0.25
    mean = np.where(known[..., None], model.mean, 0)
    across, down = np.zeros_like(mean), np.zeros_like(mean)
    across[:, 1:-1] = (mean[:, 2:] - mean[:, :-2]) / 2
    down[1:-1] = (mean[2:] - mean[:-2]) / 2
    use = np.zeros(known.shape)
    use[1:-1, 1:-1] = known[2:, 1:-1] & known[:-2, 1:-1] & known[1:-1, 2:] & known[1:-1, :-2]
    square = use[..., None] * (across**2 + down**2)
    return np.stack((square[..., 0], square[..., 1] + square[..., 2]))


def _plainly(
    lab: np.ndarray,
    rows: np.ndarray,
    model: BackgroundModel,
    config: TrackingConfig,
    strangers: np.ndarray,
) -> np.ndarray:
    """Return the log-likelihood ratios of the formula, pixel by pixel."""
    person, surroundings = models()
    slopes, sigma = _square_slopes(model), model.sigma
    bins = colour_bins(lab)
    out = np.empty(SHAPE)
    for place in np.ndindex(SHAPE):
        index, down = bins[place], rows[place]
        band = min(max(int(down * BANDS), 0), BANDS - 1)
        p_person, p_background = person.table[index, band], surroundings.table[index, band]
        count, bound = model.count[place], 6.0
        if count > 0.25:
            base, light = model.mean[place][0], float(lab[place][0])
            d_a, d_b = lab[place][1:] - model.mean[place][1:]
            spread, spread_chroma = (
                sigma**2 + model.misplacement**2 * slopes[:, place[0], place[1]]
            )
            square = (light - base) ** 2 / (2 * spread)
            chroma = (d_a**2 + d_b**2) / (2 * spread_chroma)
            ramp = min(max((down - 0.6) / 0.25, 0), 1) if base > 1 else None
            cast = 0 if ramp is None else config.shadow_share * ramp
            other = 0.0
            if config.shadow_floor * base < light < base:
                other = cast / (base * (1 - config.shadow_floor)) / (2 * np.pi * sigma**2)
            plain = (1 - cast) * np.exp(-square) / (2 * np.pi * sigma**2) ** 1.5
            seen = BIN_VOLUME * np.exp(-chroma) * (plain + other)
            trust = config.background_trust * count / (count + 0.1 + model.misplacement)
            p_background = trust * seen + (1 - trust) * p_background
        out[place] = np.clip(np.log(p_person / (p_background + strangers[place])), -bound, bound)
    return out


@pytest.mark.parametrize('misplacement', [0.0, 0.4])
def test_it_is_the_formula_pixel_by_pixel(misplacement: float) -> None:
    rng = np.random.default_rng(8)
    config, model = TrackingConfig(), BackgroundModel(SHAPE)
    for _ in range(4):
        hidden = rng.integers(0, 2, SHAPE, np.uint8)
        model.learn(rng.integers(110, 150, (*SHAPE, 3), np.uint8), hidden)
    model.sums *= np.float32(0.9)
    model.misplacement = misplacement
    lab = rng.integers(80, 180, (*SHAPE, 3), np.uint8)
    lab[..., 1:] = rng.integers(115, 145, (*SHAPE, 2))
    rows = rng.uniform(-0.2, 1.2, SHAPE).astype(np.float32)
    strangers = rng.choice([0, 1e-3], SHAPE).astype(np.float32)
    found = log_ratio(lab, rows, WINDOW, model, *models(), config, strangers)
    expected = _plainly(lab, rows, model, config, strangers)
    np.testing.assert_allclose(found, expected, atol=2e-3)

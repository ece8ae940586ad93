# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from gait_segmentation.colour import BANDS, BIN_VOLUME, colour_bins
from gait_segmentation.scene.background import BackgroundModel
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.likelihood import Colours, log_ratio

SHAPE = (20, 30)


def colours() -> Colours:
    """Return those of a person in red before grey, who fills all rows of the body."""
    learnt = Colours(TrackingConfig(band_share=0.7, colour_floor=1e-4))
    rows = np.repeat(np.linspace(0, 0.999, 20, dtype=np.float32)[:, None], 30, 1)
    red, grey = (
        np.full((*SHAPE, 3), colour, np.uint8) for colour in ((120, 200, 160), (150, 128, 128))
    )
    person = np.concatenate([np.ones(SHAPE, np.float32), np.zeros(SHAPE, np.float32)])
    two = np.concatenate([red, grey]), np.concatenate([rows, rows])
    learnt.learn(*two, (person, 1 - person), (1.0, 1.0))
    return learnt


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
    learnt = colours()
    person, surroundings = learnt.person, learnt.surroundings
    slopes, sigma = _square_slopes(model), model.sigma
    bins = colour_bins(lab)
    out = np.empty(SHAPE)
    for place in np.ndindex(SHAPE):
        index, down = bins[place], rows[place]
        band = min(max(int(down * BANDS), 0), BANDS - 1)
        p_person, p_background = person.table[index, band], surroundings.table[index, band]
        count, bound = model.count[place], 6.0
        if config.use_background and count > 0.25:
            base, light = model.mean[place][0], float(lab[place][0])
            d_a, d_b = lab[place][1:] - model.mean[place][1:]
            spread, spread_chroma = (
                sigma**2 + model.misplacement**2 * slopes[:, place[0], place[1]]
            )
            square = (light - base) ** 2 / (2 * spread)
            chroma = (d_a**2 + d_b**2) / (2 * spread_chroma)
            ramp = min(max((down - 0.6) / 0.25, 0), 1) if base > 1 and config.use_shadow else 0
            cast = config.shadow_share * ramp
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
@pytest.mark.parametrize('switches', [{}, {'use_shadow': False}, {'use_background': False}])
def test_it_is_the_formula_pixel_by_pixel(switches: dict, misplacement: float) -> None:
    rng = np.random.default_rng(8)
    config, model = TrackingConfig(**switches), BackgroundModel(SHAPE)
    for _ in range(4):
        hidden = rng.integers(0, 2, SHAPE, np.uint8)
        model.add(rng.integers(110, 150, (*SHAPE, 3), np.uint8), hidden)
    model.sums *= np.float32(0.9)
    model.misplacement = misplacement
    lab = rng.integers(80, 180, (*SHAPE, 3), np.uint8)
    lab[..., 1:] = rng.integers(115, 145, (*SHAPE, 2))
    # What only the person or only the surroundings have is limited.
    lab[0], lab[1] = (120, 200, 160), (150, 128, 128)
    rows = rng.uniform(-0.2, 1.2, SHAPE).astype(np.float32)
    strangers = rng.choice([0, 1e-3], SHAPE).astype(np.float32)
    found = log_ratio(lab, rows, model, colours(), config, strangers)
    expected = _plainly(lab, rows, model, config, strangers)
    np.testing.assert_allclose(found, expected, atol=2e-3)

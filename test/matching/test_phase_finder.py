# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from gait_segmentation.gait_model import BankSpec, build_bank, render_silhouette
from gait_segmentation.geometry import BodyFrame
from gait_segmentation.matching import MatchingConfig
from gait_segmentation.matching.evidence import FineEvidence
from gait_segmentation.matching.fine_views import FineViews
from gait_segmentation.matching.phase_finder import PhaseFinder

FPS, RATE, HEIGHT = 25, 0.95, 90.0


@pytest.fixture(scope='module')
def views():
    return FineViews(build_bank(BankSpec(azimuths=16, phases=30, builds='average')))


def errors(views, azimuths, told, off=0.01):
    """Phase errors modulo half a stride; the view told is wrong, and so are place and height."""
    rng = np.random.default_rng(0)
    finder = PhaseFinder(views, FineEvidence(views, 0.9), 30, MatchingConfig())
    found = []
    for number, (azimuth, view) in enumerate(zip(azimuths, told, strict=True)):
        phase = (0.3 + RATE * number / FPS) % 1
        drawn = render_silhouette(phase, azimuth, HEIGHT)
        image = np.zeros((140, 130), np.uint8)
        top, left = (140 - drawn.shape[0]) // 2, (130 - drawn.shape[1]) // 2
        image[top : top + drawn.shape[0], left : left + drawn.shape[1]] = drawn
        image = np.where(rng.random(image.shape) < 0.2, 255 - image, image).astype(np.uint8)
        dx, dy, dh = HEIGHT * rng.normal(0, off, 3)
        body = BodyFrame(65 + dx, 70 + dy, HEIGHT + dh)
        finder.update(image, None, body, ('average', view), 0, number / FPS)
        belief = finder.beliefs(1)[0]
        at = np.angle(belief @ np.exp(4j * np.pi * np.arange(30) / 30)) / (4 * np.pi)
        found.append((at - phase + 0.25) % 0.5 - 0.25)
    return np.array(found), finder


@pytest.mark.parametrize('degrees', [80, 95, -100])
@pytest.mark.parametrize('wrong', [-8, 8])
def test_a_wrong_view_does_not_keep_the_phase_from_being_found(views, degrees, wrong):
    azimuth, told = np.radians(degrees), np.radians(degrees + wrong)
    found, finder = errors(views, [azimuth] * 40, [told] * 40)
    assert np.sqrt((found[8:] ** 2).mean()) < 0.03
    assert finder.rate == pytest.approx(RATE, rel=0.1)


def test_turning_and_mistaking_towards_for_away(views):
    azimuths = np.radians(np.linspace(60, 150, 80))
    found, _ = errors(views, azimuths, azimuths)
    assert np.sqrt((found[8:] ** 2).mean()) < 0.03
    told = np.full(50, np.radians(80))
    told[20:] *= -1
    found, _ = errors(views, np.full(50, np.radians(80)), told)
    assert np.sqrt((found[8:] ** 2).mean()) < 0.03


def test_begins_anew(views):
    _, finder = errors(views, [1.5] * 5, [1.5] * 5)
    finder.reset()
    assert finder.rate == 0.0

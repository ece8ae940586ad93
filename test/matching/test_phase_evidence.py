# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import math

import cv2
import numpy as np
import pytest

from gait_segmentation.gait_model import TemplateBank, default_bank
from gait_segmentation.geometry import BodyFrame
from gait_segmentation.matching.phase_evidence import HEIGHTS, ROWS, FineEvidence, FineViews
from gait_tools.gait_model import BankSpec, build_bank, render_silhouette

HEIGHT = 86.4
PHASE = 8


@pytest.fixture(scope='module')
def fine():
    return FineViews(default_bank())


@pytest.fixture
def evidence(fine):
    return FineEvidence(fine, default_bank().fill)


def picture(azimuth, height=HEIGHT, down=0.0):
    drawn = render_silhouette(PHASE / 30, azimuth, height, shift=(0.0, down)).astype(float) / 255
    image = np.full((140, 130), 50.0)
    top, left = (140 - drawn.shape[0]) // 2, (130 - drawn.shape[1]) // 2
    part = image[top : top + drawn.shape[0], left : left + drawn.shape[1]]
    part += 150 * drawn
    return image.round().astype(np.uint8)


BODY = BodyFrame(65.0, 70.0, HEIGHT)


def compare(evidence, fine, image, azimuth, *, body=BODY, known=None):
    views = fine.around('average', fine.place('average', azimuth))
    every = np.ones(evidence.cells.shape, bool)
    return evidence.at(image, known, body, views, PHASE, every)


@pytest.mark.parametrize('degrees', [0.0, 60.0, 90.0, -110.0])
def test_view_height_row_and_phase_are_found_together(evidence, fine, degrees):
    azimuth = np.radians(degrees)
    found = compare(evidence, fine, picture(azimuth), azimuth)
    assert found.shape == (7, len(HEIGHTS), len(ROWS), 30)
    view, tall, row, phase = np.unravel_index(found.argmax(), found.shape)
    assert (HEIGHTS[tall], ROWS[row], phase) == (1.0, 0, PHASE)
    # Next to the axes views differ little.
    assert abs(view - 3) <= (0 if 20 < abs(degrees) < 70 else 1)


@pytest.mark.parametrize('factor', HEIGHTS)
@pytest.mark.parametrize('row', ROWS)
def test_height_and_row_are_those_of_the_body(evidence, fine, factor, row):
    image = picture(1.2, height=HEIGHT * factor, down=row * factor)
    found = compare(evidence, fine, image, 1.2)
    _, tall, down, phase = np.unravel_index(found.argmax(), found.shape)
    assert (HEIGHTS[tall], ROWS[down], phase) == (factor, row, PHASE)


def test_a_leaning_body(evidence, fine):
    turn = cv2.getRotationMatrix2D((64.5, 69.5), -20.0, 1.0)
    image = cv2.warpAffine(picture(0.9), turn, (130, 140), borderValue=50.0)
    body = BodyFrame(65.0, 70.0, HEIGHT, np.radians(20.0))
    upright = compare(evidence, fine, picture(0.9), 0.9)
    leaning = compare(evidence, fine, image, 0.9, body=body)
    assert leaning.max() == pytest.approx(upright.max(), rel=0.03)
    assert leaning.max(axis=(0, 1, 2)).argmax() == PHASE


def test_pixels_that_are_unknown_or_beyond_the_image_do_not_count(evidence, fine):
    image = picture(1.2)
    known = np.full(image.shape, 255, np.uint8)
    known[:75] = 0
    spoilt = np.where(known, image, 77).astype(np.uint8)
    clean = compare(evidence, fine, image, 1.2, known=known)
    assert compare(evidence, fine, spoilt, 1.2, known=known) == pytest.approx(clean, abs=1e-3)
    assert clean.max(axis=(0, 1, 2)).argmax() == PHASE
    known[:], known[:, :70] = 0, 255
    cut = compare(evidence, fine, np.ascontiguousarray(image[:, :70]), 1.2)
    assert cut == pytest.approx(compare(evidence, fine, image, 1.2, known=known), rel=0.1)
    away = BodyFrame(900.0, 70.0, HEIGHT)
    for mask in (None, known):
        assert not compare(evidence, fine, image, 1.2, body=away, known=mask).any()


def foreign(azimuths, height=20):
    templates = np.zeros((len(azimuths), 4, height, 15), np.uint8)
    templates[:, :, 4:16, 5:11] = 255
    names = ('mine',) * len(azimuths)
    return TemplateBank(templates, np.radians(azimuths).astype(np.float32), names, 0.9)


def test_places_go_round():
    drawn = build_bank(BankSpec(height=96, width=64, azimuths=4, phases=4, builds='average,coat'))
    views = FineViews(drawn)
    assert views.templates is drawn.finer.templates
    assert views.reach == 3
    for azimuth in np.linspace(-3.1, 3.1, 9):
        place = views.place('coat', azimuth)
        around = views.around('coat', place)
        away = abs(np.exp(1j * views.azimuths[around[3]]) - np.exp(1j * azimuth))
        assert away <= math.pi / 64 + 1e-6
        assert len(set(around)) == 7
        assert around[1:] == views.around('coat', place + 1)[:-1]
    last, first = views.place('average', math.pi - 0.1), views.place('average', -math.pi + 0.1)
    assert views.steps('average', last, first) == 2
    assert views.steps('average', first, last) == -2
    likely = views.likely()
    assert likely.argmax() == 3
    assert likely == pytest.approx(likely[::-1])


@pytest.mark.parametrize(
    ('azimuths', 'reach'),
    [([0], 0), ([0, 180], 0), (list(range(0, 360, 45)), 1), ([0, 30, 60], 0)],
)
def test_views_of_other_banks_are_used_where_they_are_close(azimuths, reach):
    drawn = foreign(azimuths)
    views = FineViews(drawn)
    assert views.reach == reach
    assert views.templates.shape == (len(azimuths), 4, 48, 36)
    assert views.templates.mean() == pytest.approx(drawn.templates.mean(), rel=0.02)
    assert len(views.around('mine', 0)) == 2 * reach + 1

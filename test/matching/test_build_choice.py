# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import itertools

import numpy as np
import pytest

from gait_segmentation.gait_model import TemplateBank
from gait_segmentation.matching import MatchingConfig
from gait_segmentation.matching.build_choice import BuildChoice, _best_near
from gait_segmentation.matching.placements import Sampled
from gait_segmentation.matching.tanimoto import WindowGrid
from gait_segmentation.matching.views import Views

NARROW, WIDE = 1, 0  # in the order of their names
VIEWS, PHASES = 8, 10
GRID = WindowGrid(12, 10, 3, 3, 2)
LEADER = (2, 4, 1, 1, 1)  # sequence, phase, scale, row and column


def template(width, left=0):
    result = np.zeros((12, 10), np.uint8)
    result[2:10, 1 + left : 1 + left + width] = 255
    return result


@pytest.fixture
def bank():
    templates = np.zeros((2 * VIEWS, PHASES, 12, 10), np.uint8)
    templates[:VIEWS], templates[VIEWS:] = template(2), template(6)
    azimuths = np.tile(np.arange(VIEWS) * 2 * np.pi / VIEWS - np.pi, 2).astype(np.float32)
    return TemplateBank(templates, azimuths, ('narrow',) * VIEWS + ('fat',) * VIEWS, 0.9)


def choice(bank, **parameters):
    templates = bank.templates.reshape(-1, 12, 10)
    return BuildChoice(bank, templates, Views(bank), GRID, MatchingConfig(**parameters))


def sampled(figure, row=1, column=1, known=None):
    images = np.zeros((5, *GRID.image_shape), np.uint8)
    images[1][GRID.part(row, column)] = figure
    return Sampled(images, known)


def test_all_builds_are_searched_first_and_then_the_one_that_leads(bank):
    builds = choice(bank)
    assert builds.of_sequence.tolist() == [NARROW] * VIEWS + [WIDE] * VIEWS
    assert builds.active.all()
    builds.update(sampled(template(2)), LEADER, 0.0)
    assert np.flatnonzero(builds.active).tolist() == [NARROW]
    builds.reset()
    assert builds.active.all()


def feed(builds, figure, first, last):
    """Show a figure for some tenths of a second; return what was searched after each frame."""
    found = []
    for k in range(first, last):
        builds.update(sampled(figure), LEADER, 0.1 * k)
        found.append(builds.only)
    return found


def test_at_first_the_build_that_fitted_best_so_far_is_searched(bank):
    builds = choice(bank, build_trial=1.0)
    assert feed(builds, template(6), 0, 4) == [NARROW, WIDE, WIDE, WIDE]
    # One frame says less than three.
    assert feed(builds, template(2), 4, 5) == [WIDE]
    assert feed(builds, template(2), 5, 9)[-1] == NARROW


def test_at_first_no_lead_is_asked_for(bank):
    builds = choice(bank, build_trial=1.0, build_lead=0.5)
    # Like the wide one to 0.83, and to the narrow one, nearby, to 0.4.
    assert feed(builds, template(5), 0, 9)[-1] == WIDE
    settled = choice(bank, build_trial=1.0, build_lead=0.5)
    feed(settled, template(2), 0, 40)
    assert feed(settled, template(5), 40, 90)[-1] == NARROW


def test_later_a_build_must_fit_better_for_long(bank):
    builds = choice(bank, build_trial=0.5)
    assert set(feed(builds, template(2), 0, 20)) == {NARROW}
    found = feed(builds, template(6), 20, 40)
    assert found[:3] == [NARROW] * 3
    assert found[8:] == [WIDE] * 12


def test_later_a_small_lead_is_not_enough(bank):
    # Like the wide one to 0.77, and to the narrow one, nearby, to 0.48.
    figure = template(5)
    figure[2, 1:4] = 0
    for lead, expected in ((0.2, WIDE), (0.4, NARROW)):
        builds = choice(bank, build_lead=lead)
        feed(builds, template(2), 0, 20)
        assert feed(builds, figure, 20, 60)[-1] == expected


def test_what_is_unknown_does_not_count(bank):
    # Beyond the second column of the person nothing is known.
    known = np.zeros((5, *GRID.image_shape), np.uint8)
    known[:, :, :5] = 255
    builds = choice(bank)
    for k in range(20):
        builds.update(sampled(template(2), known=known), LEADER, 0.1 * k)
    assert builds.only == NARROW
    builds = choice(bank)
    for k in range(20):
        builds.update(sampled(template(6) & known[0, 2:14, 2:12], known=known), LEADER, 0.1 * k)
    assert builds.only == NARROW


@pytest.mark.parametrize('axis', ['view', 'phase', 'row', 'column'])
def test_neighbours_of_where_the_path_leads_are_compared(bank, axis):
    templates = bank.templates.copy()
    row, column = (2, 1) if axis == 'row' else (1, 2) if axis == 'column' else (1, 1)
    other = VIEWS + LEADER[0], LEADER[1]
    if axis == 'view':
        other = other[0] + 1, other[1]
    if axis == 'phase':
        other = other[0], other[1] - 2
    if axis in ('view', 'phase'):
        templates[VIEWS:] = template(1)
        templates[other] = template(6)
    moved = TemplateBank(templates, bank.azimuth, bank.builds, bank.fill)
    builds = choice(moved)
    for k in range(10):
        builds.update(sampled(template(6), row, column), LEADER, 0.1 * k)
    assert builds.only == WIDE


@pytest.mark.parametrize('masked', [False, True])
def test_the_best_about_a_place_is_that_of_trying_all(masked):
    rng = np.random.default_rng(4)
    templates = rng.integers(0, 256, (4, 7, 12, 10), dtype=np.uint8)
    image, views = rng.integers(0, 256, GRID.image_shape, dtype=np.uint8), np.array([3, 0, 1])
    known = np.full_like(image, 255)
    if masked:
        known[:5] = 0
        image &= known

    def similarity(view, phase, row, column):
        part = GRID.part(row, column)
        own = templates[view, phase % 7] & known[part]
        return np.minimum(own, image[part]).sum(dtype=int) / np.maximum(own, image[part]).sum(
            dtype=int
        )

    for phase, row, column in itertools.product(range(7), range(3), range(3)):
        tried = {
            similarity(view, phase + off, row, column): (view, phase + off)
            for view in views
            for off in range(-2, 3)
        }
        beside = [(row - 1, column), (row + 1, column), (row, column - 1), (row, column + 1)]
        beside = [place for place in beside if min(place) >= 0 and max(place) < 3]
        best = max(tried)
        expected = max([best, *(similarity(*tried[best], *place) for place in beside)])
        windows = GRID.rows, GRID.columns, GRID.step
        found = _best_near(
            templates, views, phase, (row, column), windows, image, known, not masked
        )
        assert found == pytest.approx(expected, rel=1e-6)

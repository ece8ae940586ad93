# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np

from gait_segmentation.matching.tanimoto.program import PAIR, in_order, make_program


def random_templates():
    rng = np.random.default_rng(0)
    templates = (rng.integers(0, 8, (5, 40, 40)) * 36).astype(np.uint8)
    templates[3] = 255
    return templates


def test_steps_fit_16_bits():
    program = make_program(random_templates())
    span = program.span.astype(np.int64)
    assert len(program.source) == len(program.lo) == len(program.span)
    for first, _, last in PAIR * program.bounds.astype(np.int64):
        assert span[first:last].sum() <= 32767
    assert program.events == np.count_nonzero(program.span)
    assert set(program.target.tolist()) == {1, 2, 3, 4, 5}


def test_steps_join_and_use_all_places():
    program = make_program(random_templates())
    bounds = program.bounds
    assert (np.diff(bounds, axis=1) >= 0).all()
    assert bounds[0, 0] == 0
    assert (bounds[1:, 0] == bounds[:-1, 2]).all()
    assert PAIR * bounds[-1, 2] == len(program.span)


def test_events_make_the_templates():
    """What is added and subtracted where the likelihood is white is the template itself."""
    templates = random_templates()
    program = make_program(templates)
    made = np.zeros((len(templates) + 1, templates[0].size), np.int64)
    for target, base, bounds in zip(program.target, program.base, program.bounds, strict=True):
        row = made[base].copy()
        for kind, sign in enumerate((1, -1)):
            places = np.arange(PAIR * bounds[kind], PAIR * bounds[kind + 1])
            pixels = program.pixels[program.source[places]]
            np.add.at(row, pixels, sign * program.span[places].astype(np.int64))
        made[target] = row
    np.testing.assert_array_equal(made[1:], templates.reshape(len(templates), -1))


def test_rows_can_be_numbered_as_they_are_made():
    program = make_program(random_templates())
    sorted_program, place = in_order(program)
    first = [sorted_program.target.tolist().index(row + 1) for row in range(5)]
    assert first == sorted(first)
    assert sorted(place.tolist()) == list(range(5))
    assert (place[program.target - 1] + 1 == sorted_program.target).all()
    assert ((sorted_program.base == 0) == (program.base == 0)).all()
    assert sorted_program.events == program.events


def test_an_empty_template_has_a_step_without_events():
    program = make_program(np.zeros((1, 3, 3), np.uint8))
    assert program.events == 0
    assert program.target.tolist() == [1]
    assert program.base.tolist() == [0]


def test_equal_templates_are_coded_once():
    rng = np.random.default_rng(5)
    templates = rng.integers(0, 2, (3, 6, 5)).astype(np.uint8) * np.uint8(255)
    program = make_program(templates)
    assert make_program(templates.copy()) is program
    assert make_program(templates[:2]) is not program

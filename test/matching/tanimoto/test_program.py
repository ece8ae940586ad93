# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np

from gait_segmentation.matching.tanimoto.program import GROUP, make_program


def test_narrow_groups_fit_8_bits_and_steps_16():
    rng = np.random.default_rng(0)
    templates = (rng.integers(0, 8, (5, 40, 40)) * 36).astype(np.uint8)
    templates[3] = 255
    program = make_program(templates)
    sums = program.span.reshape(-1, GROUP).sum(axis=1, dtype=np.int64)
    assert len(program.source) == len(program.lo) == len(program.span)
    for bounds in program.bounds:
        for kind in (0, 2):
            assert (sums[bounds[kind] : bounds[kind + 1]] <= 255).all()
            mixed = bounds[5] - bounds[4]
            assert sums[bounds[kind] : bounds[kind + 2]].sum() + 510 * mixed <= 32767
    assert program.events == np.count_nonzero(program.span)
    assert set(program.target.tolist()) == {1, 2, 3, 4, 5}


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

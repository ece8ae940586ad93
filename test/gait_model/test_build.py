# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import pytest

from gait_segmentation.errors import BankError, ConfigError
from gait_segmentation.gait_model.build import BUILDS, FIGURES, Build, named_build


def test_names_and_builds_are_both_taken():
    assert named_build('average') is BUILDS['average']
    own = Build(girth=1.3)
    assert named_build(own) is own


def test_an_unknown_name_is_refused_with_the_known_ones():
    with pytest.raises(BankError, match=r"average.*got 'giant'"):
        named_build('giant')


def test_values_are_checked():
    with pytest.raises(ConfigError, match=r'girth must be a number from 0.6 to 1.6, got 9'):
        Build(girth=9)


def test_made_up_walkers_have_builds_that_exist():
    assert set(FIGURES) <= set(BUILDS)
    assert len(set(FIGURES)) == len(FIGURES)

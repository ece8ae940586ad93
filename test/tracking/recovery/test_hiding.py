# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What stands before a person."""

import numpy as np

from gait_segmentation.tracking.recovery.hiding import Hiding

WINDOW = (slice(0, 100), slice(0, 120))
EMPTY = np.zeros((100, 120), np.uint8)


def test_what_is_known_to_stand_there_covers_a_template() -> None:
    whole, half = EMPTY.copy(), EMPTY.copy()
    whole[20:80, 40:70] = half[20:50, 40:70] = 255
    still = EMPTY > 0
    assert not Hiding.of(WINDOW, half, whole, still).much
    still[50:] = True
    hiding = Hiding.of(WINDOW, half, whole, still)
    assert hiding.much
    assert 0.4 < hiding.share < 0.6
    assert not Hiding.of(WINDOW, whole, whole, still).much
    assert not Hiding.of(WINDOW, half, half, still).much


def test_the_edge_of_what_hides_a_person_is_not_followed() -> None:
    whole, half = EMPTY.copy(), EMPTY.copy()
    whole[20:80, 40:70] = half[20:50, 40:70] = 255
    still = EMPTY > 0
    still[50:] = True
    left = Hiding.of(WINDOW, half, whole, still).away(half)
    assert not left[44:, :].any()
    assert (left[20:42, 40:70] == 255).all()
    # Nothing hides somebody who is whole.
    assert Hiding.of(WINDOW, whole, whole, still).away(whole) is whole


def test_what_is_very_narrow_hides_nothing() -> None:
    whole, most = EMPTY.copy(), EMPTY.copy()
    whole[20:80, 40:70] = most[20:79, 40:70] = 255
    assert Hiding.of(WINDOW, most, whole, EMPTY == 0).away(most) is most

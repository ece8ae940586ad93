# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import pytest

from gait_segmentation.errors import InputError
from gait_segmentation.files.pixel_limit import check_pixels


def test_as_many_pixels_as_are_allowed_may_come_and_no_more() -> None:
    check_pixels((8192, 8192))
    check_pixels((4, 5), 20)
    with pytest.raises(InputError, match=r'at most 67108864 pixels .*, got 8193 x 8192'):
        check_pixels((8193, 8192))
    with pytest.raises(InputError, match=r'at most 19 pixels .*, got 4 x 5'):
        check_pixels((4, 5), 19)

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How large an image may claim to be."""

from __future__ import annotations

from gait_segmentation.errors import InputError

__all__ = ['MOST_PIXELS', 'check_pixels']

MOST_PIXELS = 1 << 26
"""Of an image, unless more are allowed: few cameras have more, and memory is made for them."""


def check_pixels(size: tuple[int, int], most: int = MOST_PIXELS) -> None:
    """
    Refuse image sizes from messages and files that no camera has.

    :param size: width and height.
    :param most: pixels there may be.
    :raises InputError: if there are more.
    """
    if size[0] * size[1] > most:
        raise InputError(
            f'image must have at most {most} pixels (max_pixels), got {size[0]} x {size[1]}'
        )

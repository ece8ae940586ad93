# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Boxes, body frames and the transforms between template, working image and source image.

Coordinates
    Image coordinates have x to the right and y down.  A *length* or *position* is continuous:
    the pixel in column 0 covers x from 0 to 1 and its centre is at x = 0.5, so a position is
    carried from one image size to another by multiplying with the ratio of the sizes, and by
    nothing else.  ``cv2`` counts pixel centres as integers instead; :func:`pixel_affine` turns a
    transform of positions into the matrix ``cv2.warpAffine`` wants.

Sizes
    *Source* size is the camera's; *working* size is what the likelihood and the shape prior
    have.  The width of a working image over the width of the source is the scale.

Body frame
    Templates live in the frame of the body: origin at mid height on the body's axis, x to the
    right, y down, unit the height of the body.  A template grid of H x W pixels with ``fill`` f
    covers H/(f H) = 1/f body heights vertically.
"""

from __future__ import annotations

from gait_segmentation.geometry.bodies import BodyFrame, Placement, body_window, check_body
from gait_segmentation.geometry.boxes import Box, check_matched_box, check_start_box
from gait_segmentation.geometry.transforms import (
    carry,
    compose,
    invert,
    pixel_affine,
    reach,
    scaling,
    template_to_image,
)

__all__ = [
    'BodyFrame',
    'Box',
    'Placement',
    'body_window',
    'carry',
    'check_body',
    'check_matched_box',
    'check_start_box',
    'compose',
    'invert',
    'pixel_affine',
    'reach',
    'scaling',
    'template_to_image',
]

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Pictures for people: outlines, boxes and labels over frames.

Functions named ``draw_`` change the image they are given, a (H, W, 3) uint8 BGR array.  Colours
are (blue, green, red).  Lines are anti-aliased.
"""

from __future__ import annotations

import colorsys
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.geometry import BodyFrame, Box
from gait_segmentation.images import Window, bounding_box

if TYPE_CHECKING:
    from gait_segmentation.results import MatchResult, TrackResult
    from gait_segmentation.segmentation import PeopleMasks

Colour = tuple[int, int, int]
"""Blue, green, red, 0..255."""

Image = NDArray[np.uint8]
"""(H, W, 3) BGR or (H, W) grey."""

BACKDROP: Colour = (32, 30, 28)
"""Of sheets, labels, and of what a crop shows beyond the image."""

TRACKED_COLOUR: Colour = (40, 40, 255)
"""Of the box that the tracker finds and the matcher starts from, as in the paper's figures."""

REFINED_COLOUR: Colour = (60, 230, 60)
"""Of the box that the matcher finds, as in the paper's figures."""

_SHIFT = 4  # fractional bits of the coordinates given to OpenCV's line drawing
_FONT = cv2.FONT_HERSHEY_SIMPLEX
_LARGE = 720  # longer side of an image, in pixels, above which letters and lines grow with it

_WALKS_HZ = 0.5
"""Strides a second from which somebody walks: a step a second is slow."""

_VIEW_WORDS = (
    'to the right',
    'away, right',
    'away',
    'away, left',
    'to the left',
    'closer, left',
    'closer',
    'closer, right',
)


def track_colour(track_id: int) -> Colour:
    """
    Return the colour of a track: bright, and far from those of the tracks before.

    Hues step by the golden ratio, beginning at a green that few clothes have.
    """
    hue = (0.36 + 0.618034 * (max(track_id, 1) - 1)) % 1.0
    red, green, blue = colorsys.hsv_to_rgb(hue, 0.85, 1.0)
    return round(255 * blue), round(255 * green), round(255 * red)


def view_word(azimuth: float) -> str:
    """Say in words where a person walks, from the azimuth in radians (0 right, pi/2 away)."""
    return _VIEW_WORDS[round(azimuth / (math.pi / 4)) % 8]


def _growth(image: Image) -> float:
    return max(1.0, max(image.shape[:2]) / _LARGE)


def draw_outline(image: Image, mask: NDArray[np.uint8], colour: Colour, width: int = 1) -> None:
    """Draw the outline, holes included, of a mask, (H, W) uint8, inside where above 127."""
    inside, window = _cut_out(mask)
    corner = window[1].start, window[0].start
    contours, _ = cv2.findContours(inside, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE, offset=corner)
    cv2.polylines(image, contours, True, colour, width, cv2.LINE_AA)


def _cut_out(mask: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], Window]:
    """Return where a mask is above 127, 0 or 255, in the window about that, and the window."""
    inside = cv2.inRange(mask, 128, 255)
    left, top, width, height = bounding_box(inside)
    window = slice(top, top + height), slice(left, left + width)
    return inside[window], window


def draw_box(image: Image, box: Box, colour: Colour, angle: float = 0.0) -> None:
    """Draw a box to the sub-pixel, turned about its centre to the right, in radians."""
    body = BodyFrame(box.center_x, box.center_y, box.height, angle)
    # Positions count from the corner of pixel 0, OpenCV's coordinates from its centre.
    points = (np.array(body.corners(box.width)) - 0.5) * 2**_SHIFT
    line = np.rint(points).astype(np.int32)[:, None]
    cv2.polylines(image, [line], True, colour, round(_growth(image)), cv2.LINE_AA, _SHIFT)


def draw_match(
    image: Image,
    *,
    tracked: Box | None = None,
    angle: float = 0.0,
    refined: Box | None = None,
    template: NDArray[np.uint8] | None = None,
) -> None:
    """
    Draw what matching begins with and finds: tracked box red, refined box green, template white.

    :param tracked: in the image's pixels, as ``refined``; what is None is not drawn.
    :param angle: of the tracked box, see :func:`draw_box`.
    :param template: uint8 of any size, laid over the whole image; its outline is drawn.
    """
    if template is not None:
        if template.shape != image.shape[:2]:
            size = (image.shape[1], image.shape[0])
            template = np.asarray(cv2.resize(template, size, interpolation=cv2.INTER_LINEAR))
        draw_outline(image, template, (255, 255, 255))
    if tracked is not None:
        draw_box(image, tracked, TRACKED_COLOUR, angle)
    if refined is not None:
        draw_box(image, refined, REFINED_COLOUR)


def draw_label(
    image: Image,
    text: str,
    position: tuple[float, float],
    colour: Colour = (255, 255, 255),
    size: float = 0.4,
) -> None:
    """
    Write a line of text on a dark ground, moved so that it lies inside the image.

    :param position: x and y of the label's top left corner.
    :param size: font scale, 0.4 gives letters 9 pixels high, in an image that is not large.
    """
    size, thick = size * _growth(image), round(_growth(image))
    (width, height), base = cv2.getTextSize(text, _FONT, size, thick)
    pad = 3 * thick
    full_width, full_height = width + 2 * pad, height + base + pad
    left = max(min(round(position[0]), image.shape[1] - full_width), 0)
    top = max(min(round(position[1]), image.shape[0] - full_height), 0)
    ground = image[top : top + full_height, left : left + full_width]
    ground[:] = (0.3 * ground + 0.7 * np.array(BACKDROP)).astype(np.uint8)
    baseline = (left + pad, top + height + pad - 1)
    cv2.putText(image, text, baseline, _FONT, size, colour, thick, cv2.LINE_AA)


def draw_person(image: Image, mask: NDArray[np.uint8], box: Box, match: MatchResult) -> None:
    """
    Draw all that is known of a person: tinted silhouette with outline, box, label.

    :param mask: (H, W) uint8 of the image's size.
    :param box: in the image's pixels.
    :param match: whose number is in the label, and whose view and phase in strides if they walk.
    """
    colour = track_colour(match.track_id)
    inside, window = _cut_out(mask)
    if inside.size:
        part, tints = image[window], 0.75 * np.arange(256)[:, None] + 0.25 * np.array(colour)
        cv2.copyTo(cv2.LUT(part, tints.astype(np.uint8)[None]), inside, part)
    draw_outline(image, mask, colour, round(_growth(image)))
    draw_box(image, box, colour)
    words = f'{match.track_id}'
    if match.body is not None and match.phase_rate >= _WALKS_HZ:
        words += f' {view_word(match.azimuth)} {match.phase:.2f}'
    blue, green, red = ((value + 255) // 2 for value in colour)
    draw_label(image, words, (box.x, box.y - 18 * _growth(image)), (blue, green, red))


def segmentation_picture(
    image: NDArray[np.uint8],
    masks: PeopleMasks,
    matches: Sequence[MatchResult],
    tracks: Sequence[TrackResult] = (),
) -> NDArray[np.uint8]:
    """
    Return a frame with silhouettes, templates, boxes and gait.

    :param tracks: of the same people, if they are known: their boxes are then drawn in red, and
        in place of the boxes about the masks the refined ones in green.
    """
    picture = image.copy()
    for place, (found, match) in enumerate(zip(masks.people, matches, strict=True)):
        box = Box.around(found.mask) if match.body is not None else None
        if box is None:
            continue
        if not tracks:
            draw_person(picture, found.mask, box, match)
            draw_match(picture, template=match.shape_prior)
            continue
        track = tracks[place]
        draw_person(picture, found.mask, match.box or box, match)
        draw_match(
            picture,
            tracked=track.body,
            angle=track.angle,
            refined=match.box,
            template=match.shape_prior,
        )
    return picture

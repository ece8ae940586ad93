# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np

from gait_segmentation.geometry import Box
from gait_segmentation.starting.blobs import find_blobs


def image(*boxes: tuple[int, int, int, int]) -> np.ndarray:
    """Return (120, 160) uint8, 255 in the boxes (x, y, width, height)."""
    out = np.zeros((120, 160), np.uint8)
    for x, y, width, height in boxes:
        out[y : y + height, x : x + width] = 255
    return out


def test_parts_above_each_other_are_one_body() -> None:
    body = image((40, 20, 20, 40), (42, 66, 8, 30))
    blobs, _ = find_blobs(body, body)
    assert [blob.box for blob in blobs] == [Box(40, 20, 20, 76)]
    assert blobs[0].area == blobs[0].moving == 20 * 40 + 8 * 30


def test_the_box_is_about_what_moves_now() -> None:
    # A walker beside the place that was uncovered when he left, still joined to it.
    evidence = image((20, 20, 60, 60))
    blobs, _ = find_blobs(evidence, image((60, 20, 20, 60)))
    assert [blob.box for blob in blobs] == [Box(60, 20, 20, 60)]
    assert blobs[0].area == 3600
    assert blobs[0].moving == 1200


def test_rows_are_filled_between_what_moves() -> None:
    # Of a plain coat only the edges are seen to move.
    edges = image((40, 20, 3, 60), (57, 20, 3, 60))
    coat = image((40, 20, 20, 60))
    _, filled = find_blobs(coat, edges)
    assert np.array_equal(filled, coat)


def test_specks_and_what_does_not_move_are_no_blobs() -> None:
    assert find_blobs(image((10, 10, 2, 2)), image((10, 10, 2, 2)))[0] == []
    assert find_blobs(image((10, 10, 20, 40)), image())[0] == []
    blobs, filled = find_blobs(image(), image())
    assert blobs == []
    assert not filled.any()

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import cv2
import numpy as np
import pytest

from gait_segmentation.tracking.appearance import Appearance, colour_signature
from test.tracking.figures import BLUE, GREEN, RED, Figure, picture


def looked_at(
    figure: Figure, gain: float = 1.0, part: slice = slice(None)
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    image, (mask,) = picture([figure])
    lab = cv2.cvtColor(cv2.convertScaleAbs(image, alpha=gain), cv2.COLOR_BGR2Lab)
    rows = np.arange(180, dtype=np.float32)[:, None] - (figure.y - figure.height / 2)
    rows = np.repeat(rows / np.float32(figure.height), 320, 1).astype(np.float32)
    seen = np.zeros_like(mask)
    seen[part] = mask[part]
    return lab, seen, rows


def signature(figure: Figure, gain: float = 1.0, part: slice = slice(None)) -> np.ndarray:
    return colour_signature(*looked_at(figure, gain, part))


def test_the_same_is_alike_and_others_are_not() -> None:
    appearance = Appearance(signature(Figure(58)))
    for x in (60, 62, 64):
        appearance.add(signature(Figure(x)))
    assert appearance.similarity(signature(Figure(200))) > 0.9
    assert appearance.similarity(signature(Figure(200), 1.1)) > 0.65
    for coat in (BLUE, GREEN):
        assert appearance.similarity(signature(Figure(200, coat))) < 0.6
    # What is not seen is no difference.
    assert appearance.similarity(signature(Figure(200), part=slice(0, 90))) > 0.9


def test_colours_count_by_where_on_the_body_they_are() -> None:
    lab, seen, rows = looked_at(Figure(100))
    appearance = Appearance(colour_signature(lab, seen, rows))
    # The same pixels upside down: trousers above, the coat below.
    turned = appearance.similarity(colour_signature(lab, seen, 1 - rows))
    assert turned < 0.6 < appearance.similarity(colour_signature(lab, seen, rows))


@pytest.mark.parametrize(('coat', 'found'), [(RED, True), (BLUE, False)])
def test_the_last_look_counts_only_as_far_as_it_is_the_usual_one(
    coat: tuple[int, int, int], found: bool
) -> None:
    appearance = Appearance(signature(Figure(100, RED)))
    # The last mask is that of somebody else, perhaps.
    appearance.add(signature(Figure(100, coat)))
    assert appearance.is_like(signature(Figure(120, coat))) == found


def test_without_colours_it_is_known_by_lightness() -> None:
    lab, seen, rows = looked_at(Figure(100))
    lab = lab.copy()
    lab[..., 1:] = 128
    gray = colour_signature(lab, seen, rows)
    appearance = Appearance(signature(Figure(100)))
    assert appearance.similarity(gray) < 0.5
    appearance.fade(128)
    assert appearance.similarity(gray) > 0.95

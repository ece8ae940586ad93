# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import math

import numpy as np
import pytest

from gait_segmentation.errors import InputError
from gait_segmentation.matching.inputs import check_frame

IMAGE = np.zeros((60, 80), np.uint8)


def test_returns_the_scale_of_the_likelihood():
    assert check_frame(IMAGE, 1, (160, 120), None, 0.0) == 0.5
    assert check_frame(IMAGE, 1, (80, 60), IMAGE, 0.1) == 1.0


@pytest.mark.parametrize(
    ('change', 'words'),
    [
        ({0: IMAGE.astype(np.float32)}, 'likelihood must be'),
        ({0: np.zeros((60, 80, 3), np.uint8)}, 'height, width'),
        ({0: np.zeros((0, 80), np.uint8)}, 'at least one'),
        ({1: 0}, 'positive nanoseconds'),
        ({2: (80, 0)}, 'source size'),
        ({2: (80, 80)}, 'proportions'),
        ({3: IMAGE[:30]}, 'known must have the size'),
        ({4: math.inf}, 'finite'),
    ],
)
def test_refuses(change, words):
    values = [IMAGE, 1, (80, 60), None, 0.0]
    for place, value in change.items():
        values[place] = value
    with pytest.raises(InputError, match=words):
        check_frame(*values)

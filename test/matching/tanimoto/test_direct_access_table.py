# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
from hypothesis import given, strategies as st

from gait_segmentation.matching.tanimoto.direct_access_table import splitting_ids


@given(st.lists(st.integers(0, 255), min_size=1, max_size=40), st.data())
def test_the_second_splitting_id_cannot_matter(values, data):
    ascending = np.sort(np.array([values], np.uint8))
    lower, upper = splitting_ids(ascending)
    (ranks,) = ascending.astype(int)
    for v in {*values, data.draw(st.integers(0, 255))}:
        first, last = int(lower[0, v]), int(upper[0, v])
        assert (ranks[:first] < v).all()
        assert (ranks[first:last] == v).all()
        assert (ranks[last:] > v).all()
        split = data.draw(st.integers(first, last))
        added = np.concatenate([ranks[:split], np.full(len(ranks) - split, v)])
        np.testing.assert_array_equal(added, np.minimum(ranks, v))

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import cv2
import pytest

from gait_segmentation.errors import SequenceError
from gait_segmentation.evaluation.plots import plot_priors

pytest.importorskip('matplotlib')

REPORTS = {
    prior: {'sequences': {'walk': {'error_rate': error}}, 'mean': {'error_rate': error}}
    for prior, error in (('none', 4.0), ('default', 2.0))
}


def test_a_picture_is_drawn(tmp_path):
    plot_priors(tmp_path / 'new' / 'priors.png', REPORTS)
    assert cv2.imread(str(tmp_path / 'new' / 'priors.png')).shape[0] > 200


def test_a_file_in_the_way_is_an_error(tmp_path):
    (tmp_path / 'out').write_text('')
    with pytest.raises(SequenceError, match='cannot be written'):
        plot_priors(tmp_path / 'out' / 'priors.png', REPORTS)

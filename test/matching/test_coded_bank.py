# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np

from gait_segmentation.gait_model import TemplateBank
from gait_segmentation.matching.coded_bank import coded_bank
from gait_segmentation.matching.tanimoto import WindowGrid
from test.walkers import small_bank

WINDOWS = WindowGrid(96, 64, 3, 3, 4)


def test_matchers_share_the_templates_but_not_what_they_work_in():
    bank = small_bank()
    one, two = (coded_bank(bank, 8, WINDOWS) for _ in range(2))
    assert one.templates is two.templates
    assert (one.area == one.templates.sum(axis=(1, 2))).all()
    rng = np.random.default_rng(1)
    images = rng.integers(0, 256, (2, 1, *WINDOWS.image_shape)).astype(np.uint8)
    known = np.where(images > 100, 255, 0).astype(np.uint8)
    every, of_sequence = np.array([True]), np.zeros(bank.sequences, np.intp)
    first = one.visible.rows(known[0], every, of_sequence)
    kept = first.copy()
    two.visible.rows(known[1], every, of_sequence)
    assert (first == kept).all()
    out = [one.kernels.new_rows(1) for _ in range(2)]
    for coded, image, rows in zip((one, two), images, out, strict=True):
        coded.kernels.common_rows(image, every, rows)
    template = one.templates[5].astype(int)
    for image, rows in zip(images, out, strict=True):
        window = image[0, :96, :64]
        assert rows[0, one.kernels.row.ravel()[5], 0] == np.minimum(template, window).sum()


def test_another_bank_is_coded_anew():
    bank = small_bank()
    other = TemplateBank(255 - bank.templates, bank.azimuth, bank.builds, bank.fill)
    one, two = (coded_bank(each, 8, WINDOWS) for each in (bank, other))
    assert (one.templates + two.templates == 255).all()
    assert coded_bank(bank, 2, WINDOWS).templates.max() == 255
    assert len(np.unique(coded_bank(bank, 2, WINDOWS).templates)) == 2

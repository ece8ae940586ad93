# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np

from gait_segmentation.gait_model import TemplateBank
from gait_segmentation.matching.coded_bank import coded_bank
from gait_segmentation.matching.tanimoto import WindowGrid, polyphase
from test.walkers import small_bank

WINDOWS = WindowGrid(96, 64, 3, 3, 4)


def test_matchers_share_the_templates_but_not_what_they_work_in():
    bank = small_bank()
    one, two = (coded_bank(bank, 8, WINDOWS) for _ in range(2))
    assert one.templates is two.templates
    assert one.sums is two.sums
    rng = np.random.default_rng(1)
    images = rng.integers(0, 256, (2, *WINDOWS.image_shape)).astype(np.uint8)
    planes = polyphase(images, WINDOWS)
    place = one.kernels.row.reshape(-1)[5]
    template = one.templates[5].astype(int)
    assert one.sums.whole[place] == template.sum()
    found = [
        coded.kernels.common_rows(plane, 0, (0, 0), (1, 1, 1), coded.kernels.new_rows(1))
        for coded, plane in zip((one, two), np.split(planes, 2), strict=True)
    ]
    for image, rows in zip(images, found, strict=True):
        assert rows[place, 0] == np.minimum(template, image[:96, :64]).sum()


def test_another_bank_is_coded_anew():
    bank = small_bank()
    other = TemplateBank(255 - bank.templates, bank.azimuth, bank.builds, bank.fill)
    one, two = (coded_bank(each, 8, WINDOWS) for each in (bank, other))
    assert (one.templates + two.templates == 255).all()
    assert coded_bank(bank, 2, WINDOWS).templates.max() == 255
    assert len(np.unique(coded_bank(bank, 2, WINDOWS).templates)) == 2

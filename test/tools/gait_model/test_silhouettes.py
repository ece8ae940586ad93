# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import dataclasses
import re

import cv2
import numpy as np
import pytest

from gait_segmentation.errors import BankError
from gait_tools.gait_model.builder import BankSpec, build_bank
from gait_tools.gait_model.render import render_silhouette
from gait_tools.gait_model.silhouettes import (
    SilhouetteSequence,
    autocorrelation,
    bank_from_silhouettes,
    find_contacts,
    find_step,
    read_silhouettes,
    register_silhouettes,
)

GRID, FILL = (48, 32), 0.9


def walker(frames, stride, azimuth=np.pi, start=0.0, height=60.0, build='average'):
    return np.stack(
        [
            255 * (render_silhouette(start + n / stride, azimuth, height, build=build) >= 128)
            for n in range(frames)
        ]
    ).astype(np.uint8)


@pytest.fixture(scope='module')
def masks():
    return walker(70, 31.0, start=0.1)


@pytest.fixture(scope='module')
def registered(masks):
    return register_silhouettes(masks, GRID, FILL)


@pytest.mark.parametrize(
    ('spoil', 'message'),
    [
        (lambda masks: [], 'no images in'),
        (lambda masks: [masks[0] // 255], 'no silhouettes: .* at most 1$'),
        (lambda masks: [masks[0], masks[1][:-2]], r'1\.png is 48 x .*before it are'),
        (lambda masks: [masks[0], 0 * masks[1], masks[2]], r'1\.png is empty, and those before'),
        (lambda masks: [masks[0], 255 - masks[1]], r'1\.png is white in all corners'),
    ],
)
def test_folders_that_cannot_be_used(tmp_path, masks, spoil, message):
    for number, mask in enumerate(spoil(masks)):
        cv2.imwrite(str(tmp_path / f'{number}.png'), mask)
    with pytest.raises(BankError, match=message):
        read_silhouettes(tmp_path)


def test_images_before_and_after_the_walk_may_be_empty(tmp_path, masks):
    (tmp_path / 'notes.txt').write_text('not an image')
    for n, mask in enumerate([0 * masks[0], *masks[:3], 0 * masks[0]]):
        cv2.imwrite(str(tmp_path / f'{n}.png'), mask)
    assert (read_silhouettes(tmp_path) == masks[:3]).all()


SPEC = BankSpec(height=48, width=32, phases=10)


@pytest.fixture(scope='module')
def strides():
    return walker(72, 30, start=0.6, height=80.0)


def tanimoto(first, second):
    first, second = first.astype(int), second.astype(int)
    return np.minimum(first, second).sum() / np.maximum(first, second).sum()


def test_the_bank_of_drawn_silhouettes_is_the_drawn_bank(strides):
    # The first contact comes at phase 1.0, which is the right leg's.
    walk = SilhouetteSequence(strides, np.pi, 'walker')
    bank = bank_from_silhouettes([walk], SPEC)
    drawn = build_bank(BankSpec(height=48, width=32, phases=10, azimuths=2))
    assert bank.templates.shape == (1, 10, 48, 32)
    assert bank.builds == ('walker',)
    assert tanimoto(bank.templates[0], drawn.templates[1]) > 0.88
    assert re.search('step (14.9|15.0)', bank.provenance['sequences'])
    assert len(np.unique(bank.templates)) <= 8
    mirrored = bank_from_silhouettes([walk], SPEC, mirror=True)
    assert mirrored.azimuth == pytest.approx([np.pi, 0.0])
    half = np.roll(bank.templates[0], 5, axis=0)[:, :, ::-1]
    assert tanimoto(mirrored.templates[1], half) > 0.95


def test_walkers_of_one_direction_are_averaged_if_asked(strides):
    walkers = [
        SilhouetteSequence(strides, np.pi, 'anna'),
        SilhouetteSequence(walker(72, 30, start=0.6, height=80.0, build='stout'), np.pi, 'bert'),
    ]
    spec = dataclasses.replace(SPEC, levels=256)
    apart = bank_from_silhouettes(walkers, spec, mirror=True)
    bank = bank_from_silhouettes(walkers, spec, mirror=True, average=True)
    assert apart.builds == ('anna', 'anna', 'bert', 'bert')
    assert bank.builds == ('average', 'average')
    assert bank.azimuth == pytest.approx([np.pi, 0.0])
    for view in (0, 1):
        mean = apart.templates[view::2].astype(float).mean(axis=0)
        np.testing.assert_allclose(bank.templates[view], mean, atol=0.5)
    assert not np.array_equal(apart.templates[0], apart.templates[2])
    # Who walks the other way is not averaged with them.
    other = [walkers[0], SilhouetteSequence(strides[:, :, ::-1], 0.0, 'cleo')]
    assert bank_from_silhouettes(other, spec, average=True).sequences == 2


def test_period(registered):
    assert find_step(registered) == pytest.approx(15.5, abs=0.3)
    values = autocorrelation(registered, 40)
    assert values[0] == pytest.approx(1)
    assert values[31] > 0.8 > 0 > values[8]


def test_too_short_and_without_rhythm(registered):
    with pytest.raises(BankError, match='at least 14 silhouettes, got 9'):
        find_step(registered[:9])
    with pytest.raises(BankError, match='50 silhouettes show no period'):
        find_step(np.repeat(registered[:1], 50, axis=0))
    with pytest.raises(BankError, match='fewer than three heel contacts'):
        find_contacts(registered[:25], 15.5)

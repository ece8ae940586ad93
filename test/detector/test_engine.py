# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import cv2
import numpy as np
import pytest

from gait_segmentation.detector import engine
from gait_segmentation.detector.engine import Engine
from gait_segmentation.detector.person_detector import MODEL as DETECTOR
from gait_segmentation.detector.person_masks import MODEL as MASKS
from gait_segmentation.errors import DetectorError
from test.networks import demo_picture


@pytest.mark.parametrize(
    ('network', 'mean', 'part'), [(MASKS, 0.0, slice(None)), (DETECTOR, 127.5, 0)]
)
def test_the_same_is_seen_with_and_without_onnx_runtime(monkeypatch, network, mean, part):
    blob = cv2.dnn.blobFromImage(
        cv2.resize(demo_picture()[20:200, 420:], (224, 224)), mean=[mean] * 3
    )
    fast = Engine(network)(blob)
    monkeypatch.setattr(engine, 'onnx_runtime', lambda: None)
    odds = fast, Engine(network)(blob)
    first, second = (1 / (1 + np.exp(-np.clip(each[part], -20, 20))) for each in odds)
    assert np.ptp(first) > 0.3
    # A grey value.
    np.testing.assert_allclose(first, second, atol=1 / 255)


@pytest.mark.parametrize('runs', [True, False])
@pytest.mark.parametrize('content', [None, b'', b'text'])
def test_what_is_no_network_is_refused_with_a_way_out(tmp_path, monkeypatch, content, runs):
    if not runs:
        monkeypatch.setattr(engine, 'onnx_runtime', lambda: None)
    path = tmp_path / 'spoilt.onnx.gz'
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(DetectorError, match=r'spoilt\.onnx\.gz .*network: none does without'):
        Engine(path)

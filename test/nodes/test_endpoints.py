# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import pytest
from std_msgs.msg import Int32

from gait_segmentation.ros.endpoints import BETWEEN_NODES, subscription
from test.nodes.bench import Bench


@pytest.mark.parametrize('cut', [b'', b'\0', b'\0\1\0\0\7'])
def test_a_message_that_is_cut_off_is_ignored(bench: Bench, cut: bytes) -> None:
    """As a process that was killed may leave it."""
    got: list[int] = []
    said: list[str] = []
    subscription(
        bench.probe,
        Int32,
        'number',
        BETWEEN_NODES,
        lambda message: got.append(message.data),
        lambda key, text: said.append(text),
    )
    publisher = bench.publisher(Int32, 'number', 1)
    for message in (Int32(data=1), cut, Int32(data=2)):
        publisher.publish(message)
    bench.until(lambda: 2 in got, 'the message after')
    assert got == [1, 2]
    assert all('a message on number was cut off' in text for text in said)

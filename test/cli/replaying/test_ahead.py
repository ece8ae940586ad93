# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import closing

import pytest

from gait_segmentation.cli.replaying.ahead import ahead


def test_the_items_come_in_order_and_then_the_error() -> None:
    def items() -> Iterator[int]:
        yield from range(20)
        raise ValueError('here')

    found = []
    with pytest.raises(ValueError, match='here'):
        found.extend(ahead(items(), depth=3))
    assert found == list(range(20))
    assert list(ahead(iter([]))) == []


def test_what_is_given_up_is_closed() -> None:
    closed = []

    def items() -> Iterator[int]:
        try:
            number = 0
            while True:
                yield number
                number += 1
        finally:
            closed.append(threading.current_thread().name)

    with closing(ahead(items(), depth=2)) as numbers:
        assert [next(numbers), next(numbers)] == [0, 1]
    assert closed == ['ahead']

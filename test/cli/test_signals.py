# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import signal

import pytest

from gait_segmentation.cli.signals import handled


def test_signals_are_handled_as_before_after_the_context() -> None:
    before, came = signal.getsignal(signal.SIGTERM), []
    with handled(lambda number, _: came.append(number), signal.SIGTERM):
        signal.raise_signal(signal.SIGTERM)
    assert came == [signal.SIGTERM]
    assert signal.getsignal(signal.SIGTERM) == before


def fail(number: int, frame: object) -> None:
    raise ZeroDivisionError


def test_signals_are_handled_as_before_after_an_error() -> None:
    before = signal.getsignal(signal.SIGTERM)
    with pytest.raises(ZeroDivisionError), handled(fail, signal.SIGTERM):
        signal.raise_signal(signal.SIGTERM)
    assert signal.getsignal(signal.SIGTERM) == before

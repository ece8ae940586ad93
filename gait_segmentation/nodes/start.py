# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
The commands of the nodes.

What a node needs takes a while to import, and Ctrl-C is to end it quietly from the beginning:
this imports nothing else before it has seen to that.
"""

from __future__ import annotations

import os
import signal
from importlib import import_module

__all__ = ['matcher', 'pipeline', 'segmenter', 'source', 'tracker']


def tracker() -> int:
    """Run gait_tracker."""
    return _run('tracker_node')


def matcher() -> int:
    """Run gait_matcher."""
    return _run('matcher_node')


def segmenter() -> int:
    """Run gait_segmenter."""
    return _run('segmenter_node')


def pipeline() -> int:
    """Run gait_pipeline."""
    return _run('pipeline_node')


def source() -> int:
    """Run gait_source."""
    return _run('source_node')


def _run(name: str) -> int:
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    for number, handler in before.items():
        # Those ignored, as of what a shell runs in the background, stay so.
        if handler != signal.SIG_IGN:
            signal.signal(number, _end)
    module = import_module(f'gait_segmentation.nodes.{name}')
    for number, handler in before.items():
        signal.signal(number, handler)
    return int(module.main())


def _end(number: int, frame: object) -> None:
    """End at once: nothing is there yet to be closed, and imports may swallow an exception."""
    os._exit(0)

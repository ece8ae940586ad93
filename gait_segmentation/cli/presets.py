# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Presets: installed parameter files by the names they have on the command line."""

from __future__ import annotations

import argparse
from pathlib import Path

from gait_segmentation.ros.files import shared_file

__all__ = ['add_preset_option', 'preset_file']

_PRESETS = {'default': 'gait_segmentation.yaml', 'paper': 'paper.yaml'}


def add_preset_option(parser: argparse.ArgumentParser) -> None:
    """Add the option that names a preset, None if it is not given; see :func:`preset_file`."""
    parser.add_argument(
        '--preset',
        choices=tuple(_PRESETS),
        help='parameters to begin with, which other options override: paper is the system as '
        'published, see docs/paper.md',
    )


def preset_file(name: str) -> Path:
    """
    Return the parameter file of a preset, for :func:`read_parameter_file` and for nodes.

    :raises ConfigError: if it is not installed.
    """
    return shared_file(f'config/{_PRESETS[name]}')

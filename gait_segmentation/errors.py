# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Errors of this package: one root and a leaf for each kind of cause."""

from __future__ import annotations


class GaitSegmentationError(Exception):
    """Root of every error this package raises on purpose."""


class ConfigError(GaitSegmentationError, ValueError):
    """A parameter has a value outside what it allows."""


class InputError(GaitSegmentationError, ValueError):
    """An image, box, stamp or mask given to a stage cannot be used."""


class BankError(GaitSegmentationError):
    """A template bank is malformed, of another version, or cannot be read or written."""


class SequenceError(GaitSegmentationError):
    """A clip or a sequence folder is missing, incomplete or corrupt."""


class DetectorError(GaitSegmentationError):
    """A detector cannot be loaded, has not started, has ended, or does not answer."""


def one_line(error: object) -> str:
    """Return what an error says, such as one of OpenCV, in one line."""
    return ' '.join(str(error).split())


EXTRAS = {
    **dict.fromkeys(('lz4', 'rosbags', 'tqdm'), 'tools'),
    'distributed': 'archive',
    'onnxruntime': 'fast',
}
"""Modules that nodes run without, and the extra of setup.py that brings them."""


def not_installed(package: str) -> str:
    """Return what to do about a package of an extra that is missing."""
    extra = EXTRAS.get(package, 'tools')
    return (
        f'the Python package {package} is not installed: pip install {package}, or '
        f"'.[{extra}]' for all of the {extra}"
    )

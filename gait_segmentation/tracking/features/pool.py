# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The modules of this package that are features."""

from __future__ import annotations

import pkgutil
from functools import cache
from importlib import import_module
from pathlib import Path

from gait_segmentation.tracking.features.base import ChannelFeature, Feature

__all__ = ['channels', 'pool']


@cache
def pool() -> tuple[Feature, ...]:
    """Return all features there are, by the names of their modules."""
    package = __name__.rpartition('.')[0]
    names = sorted(each.name for each in pkgutil.iter_modules([str(Path(__file__).parent)]))
    modules = [import_module(f'{package}.{name}') for name in names if name != 'pool']
    return tuple(module.FEATURE for module in modules if hasattr(module, 'FEATURE'))


@cache
def channels() -> tuple[ChannelFeature, ...]:
    """Return those features that are channels."""
    return tuple(feature for feature in pool() if isinstance(feature, ChannelFeature))

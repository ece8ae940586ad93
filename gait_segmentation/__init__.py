# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Live silhouettes of walking people, on a CPU."""

import os
from importlib import import_module
from typing import Any

__version__ = '0.1.0'

MOST_PIXELS = 1 << 26
"""Of an image, unless more are allowed: few cameras have more, and memory is made for them."""

# OpenCV reads it when it is loaded.
os.environ.setdefault('OPENCV_IO_MAX_IMAGE_PIXELS', str(MOST_PIXELS))

_PLACES = {
    'Box': 'geometry',
    'Pipeline': 'pipeline',
    'PipelineConfig': 'pipeline',
    'open_input': 'inputs',
}
"""What most programs need, and the modules that they are in."""

__all__ = ['MOST_PIXELS', '__version__', *_PLACES]


def __getattr__(name: str) -> Any:
    # When it is asked for: a node is not to load what others work with.
    if name not in _PLACES:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    return getattr(import_module(f'{__name__}.{_PLACES[name]}'), name)

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Live silhouettes of walking people, on a CPU."""

import os

__version__ = '0.1.0'

MOST_PIXELS = 1 << 26
"""Of an image, unless more are allowed: few cameras have more, and memory is made for them."""

# OpenCV reads it when it is loaded.
os.environ.setdefault('OPENCV_IO_MAX_IMAGE_PIXELS', str(MOST_PIXELS))

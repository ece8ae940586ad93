# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Live silhouettes of walking people, on a CPU, without a neural network."""

__version__ = '0.1.0'

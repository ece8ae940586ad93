# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Matching: the best path of gait silhouettes through the likelihood images."""

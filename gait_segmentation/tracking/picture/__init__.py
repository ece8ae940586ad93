# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The frame as the tracker works on it: scaled down once, light and levels made even."""

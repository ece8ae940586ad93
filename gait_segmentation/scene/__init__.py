# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the camera shows beside people: light, contrast, the camera's motion, the background."""

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The gait model: kinematics, a body, its silhouettes, and the bank of templates."""

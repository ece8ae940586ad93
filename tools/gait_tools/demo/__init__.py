# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What gait_demo is made of: the film, the nodes as processes, and what they publish."""

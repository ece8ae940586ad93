# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""People who are hidden or lost: what is seen of them, and how they are found again."""

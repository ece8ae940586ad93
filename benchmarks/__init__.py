# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The programs behind the figures in the docs, and what they are run on; not installed."""

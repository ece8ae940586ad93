# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Reading and writing files: what may be opened, decoded and overwritten."""

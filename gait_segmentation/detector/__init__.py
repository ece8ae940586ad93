# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A network that says where people are, run by a Python of its own beside the tracker."""

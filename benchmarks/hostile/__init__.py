# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Hostile messages for the nodes, and what starts the nodes and watches them meanwhile."""

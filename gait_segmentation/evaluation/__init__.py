# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluation: sequences on disk, synthetic walkers, metrics, pictures and reports."""

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluation: sequences on disk, metrics, pictures and reports."""

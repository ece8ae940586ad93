# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Evaluation: sequences on disk, metrics, pictures and reports.

The command ``gait_evaluate`` is a thin shell round :class:`session.Session`.
"""

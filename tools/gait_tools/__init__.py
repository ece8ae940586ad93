# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What robots do not run: drawing banks of templates, learning words, evaluation."""

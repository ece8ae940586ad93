# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What sequences by lot are made of; for ``fuzz_pipeline.py``."""

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What only the system as published needs: its features, oriented prior and vocabulary."""

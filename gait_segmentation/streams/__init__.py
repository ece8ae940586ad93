# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a live stream needs, whatever brings it: waiting, joining, counting, first boxes, names."""

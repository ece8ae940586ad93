# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What live nodes and replays share: first boxes, names, parameters, what messages say."""

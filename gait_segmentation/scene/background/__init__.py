# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the surroundings look like: remembered pixel by pixel, carried along, compared."""

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How likely pixels are of a person: log-likelihood ratios, and what is added to them."""

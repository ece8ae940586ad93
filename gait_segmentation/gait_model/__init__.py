# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The bank of templates: the standard one, and files that ``gait_bank`` makes."""

from gait_segmentation.gait_model.bank import TemplateBank, default_bank, open_bank

__all__ = ['TemplateBank', 'default_bank', 'open_bank']

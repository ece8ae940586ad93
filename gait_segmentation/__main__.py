# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The commands as ``python -m gait_segmentation tracker``, where they are not installed."""

from __future__ import annotations

import sys

from gait_segmentation.commands import main

if __name__ == '__main__':
    sys.exit(main())

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Boxes and bodies for tests of properties."""

from __future__ import annotations

from hypothesis import strategies as st

from gait_segmentation.geometry import BodyFrame, Box

numbers = st.floats(-500, 500)
sizes = st.floats(0.5, 500)
boxes = st.builds(Box, numbers, numbers, sizes, sizes)
bodies = st.builds(BodyFrame, numbers, numbers, sizes, st.floats(-1.2, 1.2))

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The nodes: adapters between topics and the stages."""

try:
    import rclpy  # noqa: F401
except ModuleNotFoundError as error:
    raise SystemExit(
        f'there is no ROS 2 for this Python (no module {error.name}): source its setup, such as '
        "/opt/ros/jazzy/setup.bash, or pip install '.[ros]'"
    ) from error

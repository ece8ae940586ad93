# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where ROS writes its logs: it does not start where it cannot."""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path

from gait_segmentation.files.paths import make_writable


def log_where_possible() -> None:
    """
    Have ROS log to a temporary folder if it cannot write where it would, and say so.

    As in containers and services: there is no HOME, or nobody may write there.  The order of the
    variables is that of rcl_logging.
    """
    home = os.environ.get('HOME', '')
    other = os.environ.get('ROS_HOME', '')
    given = os.environ.get('ROS_LOG_DIR') or (f'{other}/log' if other else '~/.ros/log')
    try:
        if given.startswith('~') and not home:
            raise FileNotFoundError(2, 'there is no HOME', given)
        folder = Path(given.replace('~', home, 1) if given.startswith('~') else given)
        make_writable(folder)
    except OSError as error:
        os.environ['ROS_LOG_DIR'] = tempfile.mkdtemp(prefix='ros_log_')
        print(
            f'logs cannot be written to {given} ({error.strerror}): they are in '
            f'{os.environ["ROS_LOG_DIR"]}',
            file=sys.stderr,
        )

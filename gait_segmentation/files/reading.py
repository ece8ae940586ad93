# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""YAML that people write."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

from gait_segmentation.errors import GaitSegmentationError


def read_yaml(path: Path, kind: type[GaitSegmentationError]) -> Any:
    """
    Read a YAML file.

    :param kind: of the error to be raised.
    :returns: what it holds, None if that is nothing.
    :raises GaitSegmentationError: of the kind, if it cannot be read or is not plain YAML.
    """
    try:
        return yaml.safe_load(path.read_text(encoding='utf-8'))
    except OSError as error:
        raise kind(f'{path} cannot be read: {error.strerror}') from error
    except (yaml.YAMLError, ValueError) as error:
        # Values such as dates are made by Python, which has errors of its own.
        raise kind(
            f'{path} is not YAML that can be used: {" ".join(str(error).split())}'
        ) from error

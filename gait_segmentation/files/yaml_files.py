# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""YAML files that people write: whatever is wrong with one is an error in one line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

from gait_segmentation.errors import GaitSegmentationError
from gait_segmentation.files.regular_files import regular

__all__ = ['read_yaml']

_DEEPEST = 20
"""Levels; none of the files read here needs more than four."""


class _Loader(yaml.SafeLoader):
    """Refuses aliases, with which few bytes can stand for anything, and great depth."""

    def __init__(self, stream: str) -> None:
        super().__init__(stream)
        self._depth = 0

    def compose_node(self, parent: Any, index: Any) -> Any:
        """Compose a node, unless it is an alias or lies too deep."""
        mark = self.peek_event().start_mark
        if self.check_event(yaml.AliasEvent):
            raise yaml.composer.ComposerError(None, None, 'aliases (*name) cannot be used', mark)
        if self._depth == _DEEPEST:
            raise yaml.composer.ComposerError(
                None, None, f'more than {_DEEPEST} levels cannot be used', mark
            )
        self._depth += 1
        node = super().compose_node(parent, index)
        self._depth -= 1
        return node


def read_yaml(path: Path, kind: type[GaitSegmentationError]) -> Any:
    """
    Read a YAML file.

    :param kind: of the error to be raised.
    :returns: what it holds, None if that is nothing.
    :raises GaitSegmentationError: of the kind, if it cannot be read or is not plain YAML.
    """
    try:
        return yaml.load(regular(path).read_text(encoding='utf-8'), _Loader)
    except OSError as error:
        raise kind(f'{path} cannot be read: {error.strerror}') from error
    except (yaml.YAMLError, ValueError, OverflowError, RecursionError) as error:
        # Values such as dates and numbers are made by Python, which has errors of its own.
        problem = ' '.join(str(error).split())
        raise kind(f'{path} is not YAML that can be used: {problem}') from error

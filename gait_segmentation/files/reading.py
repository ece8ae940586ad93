# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Files that are opened to be read: no pipes or devices, and YAML that people write.

A pipe or a device may block whoever opens it, or never end.
"""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path
from typing import Any

import yaml

from gait_segmentation.errors import GaitSegmentationError

_OTHERS = {
    stat.S_IFIFO: 'a pipe',
    stat.S_IFCHR: 'a device',
    stat.S_IFBLK: 'a device',
    stat.S_IFDIR: 'a folder',
    stat.S_IFSOCK: 'a socket',
}


def regular(path: str | os.PathLike[str]) -> Path:
    """
    Return the path of a file that may be opened to be read to its end.

    :raises OSError: if it is missing, or no file but a pipe, a device, a folder or a socket;
        ``strerror`` says so.
    """
    mode = os.stat(path).st_mode
    if not stat.S_ISREG(mode):
        what = _OTHERS.get(stat.S_IFMT(mode), 'something else')
        raise OSError(errno.EINVAL, f'it is {what} and no file', os.fspath(path))
    return Path(path)


def read_yaml(path: Path, kind: type[GaitSegmentationError]) -> Any:
    """
    Read a YAML file.

    :param kind: of the error to be raised.
    :returns: what it holds, None if that is nothing.
    :raises GaitSegmentationError: of the kind, if it cannot be read or is not plain YAML.
    """
    try:
        text = regular(path).read_text(encoding='utf-8')
        content = yaml.safe_load(text)
        # With which few bytes can stand for anything.
        if any(isinstance(each, yaml.AliasEvent) for each in yaml.parse(text)):
            raise yaml.YAMLError('aliases (*name) cannot be used')
        return content
    except OSError as error:
        raise kind(f'{path} cannot be read: {error.strerror}') from error
    except (yaml.YAMLError, ValueError, OverflowError, RecursionError) as error:
        # Values such as dates and numbers are made by Python, which has errors of its own.
        problem = ' '.join(str(error).split())
        raise kind(f'{path} is not YAML that can be used: {problem}') from error

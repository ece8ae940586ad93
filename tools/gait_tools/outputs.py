# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Places that can be written to and are not somebody else's, and writing there."""

from __future__ import annotations

import io
import json
import tempfile
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from gait_segmentation.errors import ConfigError, SequenceError
from gait_segmentation.files import write_file

if TYPE_CHECKING:  # which takes long to load
    from matplotlib.figure import Figure

_HEAD = 4096  # bytes of a file by which its kind is told
_SOFTWARE = 'gait_segmentation'  # what PNGs say that are written here


def make_folder(option: str, folder: Path) -> None:
    """Make the folder that an option names, before what is to be written is worked out."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError as error:
        raise ConfigError(
            f'{option} {folder}: nothing can be written: {error.strerror}'
        ) from error


def check_file(path: Path) -> None:
    """Make sure that a file can be written, before what is to be written is worked out."""
    there = path.exists()
    try:
        path.open('ab').close()
        if not there:
            path.unlink()
    except OSError as error:
        raise ConfigError(f'{path} cannot be written: {error.strerror}') from error


def keep_others(
    outputs: Iterable[tuple[str, Path | None, Callable[[bytes], bool]]], maker: str
) -> None:
    """Refuse outputs that would replace a file of another kind: (what it is, where, is it own)."""
    for name, path, is_own in outputs:
        if path is None or not path.is_file():
            continue
        with path.open('rb') as file:
            head = file.read(_HEAD)
        if head and not is_own(head):
            raise ConfigError(
                f'{name} {path} was not made by {maker} and is not replaced: remove it or choose '
                'another place'
            )


def with_part(page: Path, name: str, part: str) -> str:
    """Return a Markdown page with another part between the marks of that name."""
    try:
        head, begin, rest = page.read_text(encoding='utf-8').partition(f'<!-- {name} -->\n')
    except (OSError, ValueError) as error:
        raise ConfigError(f'{page} cannot be read: {error}') from error
    _, end, tail = rest.partition('<!-- end -->')
    if not end:
        raise ConfigError(f'{page} must have lines <!-- {name} --> and <!-- end -->')
    return f'{head}{begin}{part}{end}{tail}'


def is_own_picture(head: bytes) -> bool:
    """Return whether a file begins as a PNG that was written here."""
    return b'tEXtSoftware\0' + _SOFTWARE.encode() in head


def write(path: Path, data: bytes) -> None:
    """Write a file, making its folder; say in words if that cannot be."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_file(path, data)
    except OSError as error:
        raise SequenceError(f'{path} cannot be written: {error.strerror or error}') from error


def write_json(path: Path, report: Mapping[str, Any]) -> None:
    """Write a report."""
    write(path, (json.dumps(report, indent=2) + '\n').encode())


def write_image(path: Path, image: NDArray[np.uint8]) -> None:
    """Write a grey or BGR image as PNG that says that it is from here."""
    about, data = PngInfo(), io.BytesIO()
    about.add_text('Software', _SOFTWARE)
    colours = image if image.ndim == 2 else image[..., ::-1]
    Image.fromarray(colours).save(data, 'PNG', pnginfo=about)
    write(path, data.getvalue())


def write_figure(path: Path, figure: Figure) -> None:
    """Write a figure of the format that the name says; a PNG says that it is from here."""
    data = io.BytesIO()
    try:
        figure.savefig(data, format=path.suffix[1:], metadata={'Software': _SOFTWARE})
    except ValueError as error:
        raise SequenceError(
            f'{path} cannot be written: its name must end in .png or another format of Matplotlib'
        ) from error
    write(path, data.getvalue())

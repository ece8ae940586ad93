# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What may have become of a file."""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from random import Random

__all__ = ['MUTATIONS', 'mutate']

_HUGE = (0, 1, 0x7F, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF)
_WORDS = ('1e400', '-1', '.nan', '.inf', '9' * 30, '9' * 5000, "'x'", '[]', '{}', '~', 'true',
          '2001-99-99', '\\x00', '*a', '&a [*a]', '[' * 3000, '{a: ' * 3000, '1e-320')  # fmt: skip

Change = Callable[[Random, bytes], bytes]
Replace = Callable[[Random, Path], None]


def _place(rng: Random, data: bytes) -> int:
    """Return a place, in the first bytes as often as anywhere."""
    return rng.randrange(max(min(len(data), rng.choice([64, len(data)])), 1))


def _flip(rng: Random, data: bytes) -> bytes:
    made = bytearray(data)
    for _ in range(rng.choice([1, 3, 30]) if data else 0):
        made[_place(rng, data)] ^= 1 << rng.randrange(8)
    return bytes(made)


def _truncate(rng: Random, data: bytes) -> bytes:
    return data[: rng.randrange(len(data) + 1)]


def _zero(rng: Random, data: bytes) -> bytes:
    at, length = _place(rng, data), rng.choice([4, 64, 4096])
    return data[:at] + bytes(min(length, len(data) - at)) + data[at + length :]


def _duplicate(rng: Random, data: bytes) -> bytes:
    at, length = _place(rng, data), rng.choice([8, 256, 10_000])
    return data[:at] + data[at : at + length] * rng.choice([2, 50]) + data[at + length :]


def _splice(rng: Random, data: bytes) -> bytes:
    one, two = sorted((_place(rng, data), _place(rng, data)))
    return data[:two] + data[one:]


def _garbage(rng: Random, data: bytes) -> bytes:
    at = _place(rng, data)
    return data[:at] + rng.randbytes(rng.choice([1, 16, 1000])) + data[at:]


def _number(rng: Random, data: bytes) -> bytes:
    at, form = _place(rng, data), rng.choice('<>') + rng.choice('HIQ')
    value = rng.choice(_HUGE) & (2 ** (8 * struct.calcsize(form)) - 1)
    return data[:at] + struct.pack(form, value) + data[at + struct.calcsize(form) :]


def _size(rng: Random, data: bytes) -> bytes:
    """Let an image claim another size, in a PNG with the right sum."""
    width, height = (rng.choice([0, 1, 3, 70_000, 2**31 - 1]) for _ in range(2))
    if data[:4] == b'\x89PNG':
        header = data[12:16] + struct.pack('>II', width, height) + data[24:29]
        return data[:12] + header + struct.pack('>I', zlib.crc32(header)) + data[33:]
    at = data.find(b'\xff\xc0')
    if at > 0:
        return data[: at + 5] + struct.pack('>HH', height & 65535, width & 65535) + data[at + 9 :]
    return _number(rng, data)


def _text(rng: Random, data: bytes) -> bytes:
    """Change a value of a text."""
    word = rng.choice(_WORDS).encode()
    at = [index for index, byte in enumerate(data[:20_000]) if byte in b':,[']
    place = rng.choice(at) + 1 if at else 0
    end = min((e for e in (data.find(b, place) for b in b',]}\n') if e >= 0), default=len(data))
    return data[:place] + b' ' + word + data[end:]


def _empty(rng: Random, data: bytes) -> bytes:
    return b''


def _fifo(rng: Random, path: Path) -> None:
    os.mkfifo(path)


def _device(rng: Random, path: Path) -> None:
    path.symlink_to(rng.choice(['/dev/null', '/dev/zero', '/dev/full', '/dev/tty']))


def _folder(rng: Random, path: Path) -> None:
    path.mkdir()


def _link_in_a_circle(rng: Random, path: Path) -> None:
    path.symlink_to(path.name)


def _link_to_nothing(rng: Random, path: Path) -> None:
    path.symlink_to('nowhere')


def _missing(rng: Random, path: Path) -> None:
    pass


def _forbidden(rng: Random, path: Path) -> None:
    path.write_bytes(b'secret')
    path.chmod(0)


CHANGES: dict[str, Change] = {
    'flip': _flip,
    'truncate': _truncate,
    'zero': _zero,
    'duplicate': _duplicate,
    'splice': _splice,
    'garbage': _garbage,
    'number': _number,
    'size': _size,
    'text': _text,
    'empty': _empty,
}
REPLACEMENTS: dict[str, Replace] = {
    'fifo': _fifo,
    'device': _device,
    'folder': _folder,
    'circle': _link_in_a_circle,
    'nothing': _link_to_nothing,
    'missing': _missing,
    'forbidden': _forbidden,
}
MUTATIONS = (*CHANGES, *REPLACEMENTS, 'name')


def mutate(path: Path, how: str, rng: Random) -> Path:
    """
    Change an input, one of its files if it is a folder.

    :returns: where the input is now.
    """
    files = sorted(each for each in path.rglob('*') if each.is_file()) or [path]
    chosen = rng.choice(files)
    if how in CHANGES:
        if how == 'text':
            texts = [each for each in files if each.suffix in ('.yaml', '.json')]
            chosen = rng.choice(texts) if texts else chosen
        chosen.write_bytes(CHANGES[how](rng, chosen.read_bytes()))
        return path
    if how == 'name':
        name = rng.choice(['9' * 40, '-x', 'ä ö', 'a\nb', '\udcff', 'x' * 240, '.hidden', '0'])
        moved = chosen.rename(chosen.with_name(name + chosen.suffix))
        return moved if chosen == path else path
    chosen.unlink()
    REPLACEMENTS[how](rng, chosen)
    return path

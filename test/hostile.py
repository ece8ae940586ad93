# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What tests of hostile input share: how many examples there are, and bytes that are spoilt."""

from __future__ import annotations

import struct
import zlib
from typing import Any

from hypothesis import HealthCheck, Phase, settings, strategies as st

WORDS = ('1e400', '-1', '.nan', '9' * 5000, "'x'", '[]', '{}', '~', '2001-99-99', '*a', '&a [*a]',
         '[' * 3000, '{a: ' * 3000)  # fmt: skip
NUMBERS = (0, 1, 0x7F, 0xFF, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF)


def examples(few: int, many: int) -> settings:
    """Return the settings of a test: few examples of the gate's, or many of ``make fuzz``."""
    number = few if settings.default.derandomize else many
    suppressed = [HealthCheck.too_slow, HealthCheck.function_scoped_fixture]
    suppressed += [HealthCheck.data_too_large, HealthCheck.large_base_example]
    # Each takes long: what they have in common is not worked out.
    phases = [each for each in Phase if each is not Phase.explain]
    return settings(max_examples=number, suppress_health_check=suppressed, phases=phases)


@st.composite
def spoilt_bytes(draw: Any, data: bytes) -> bytes:
    """Draw what has become of a file: cut off, flipped, spliced, with huge numbers or words."""
    how = draw(st.sampled_from(('flip', 'cut', 'splice', 'number', 'size', 'word', 'none')))
    # In the first bytes as often as anywhere.
    reach = draw(st.sampled_from((64, len(data))))
    at = draw(st.integers(0, max(min(len(data), reach) - 1, 0)))
    if how == 'flip':
        return data[:at] + bytes(each ^ 1 << at % 8 for each in data[at : at + 1]) + data[at + 1 :]
    if how == 'cut':
        return data[:at]
    if how == 'splice':
        long = draw(st.sampled_from((9, 400, 4096, len(data))))
        new = draw(st.sampled_from((b'', bytes(long), data[at // 2 :], data[at:][:9999] * 50)))
        return data[:at] + new + data[at + long :]
    if how == 'size' and data[:4] == b'\x89PNG':
        sides = st.sampled_from((0, 1, 3, 70_000, 2**31 - 1))
        head = data[12:16] + struct.pack('>II', draw(sides), draw(sides)) + data[24:29]
        return data[:12] + head + struct.pack('>I', zlib.crc32(head)) + data[33:]
    if how in ('number', 'size'):
        number = struct.pack(draw(st.sampled_from('<>')) + 'I', draw(st.sampled_from(NUMBERS)))
        return data[:at] + number + data[at + 4 :]
    if how == 'word':
        places = [place for place, byte in enumerate(data[:20_000]) if byte in b':,['] or [0]
        at = draw(st.sampled_from(places)) + 1
        ends = [place for place in (data.find(each, at) for each in b',]}\n') if place >= 0]
        end = min(ends, default=len(data))
        return data[:at] + b' ' + draw(st.sampled_from(WORDS)).encode() + data[end:]
    return b''

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A damaged cache of kernels, with a kernel of the test's own that compiles quickly."""

from __future__ import annotations

import importlib
import os
import pickle
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from gait_segmentation.errors import ConfigError
from gait_segmentation.kernel_cache import is_damaged, mend_kernel_cache
from gait_segmentation.kernels import compile_kernels
from gait_segmentation.pipeline import Pipeline

KERNEL = """
from numba import njit

@njit(cache=True)
def one():
    return 1
"""

DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    'truncated': lambda data: data[: len(data) // 2],
    'without its last byte': lambda data: data[:-1],
    'empty': lambda data: b'',
    'zeros': lambda data: bytes(len(data)),
    'garbage': lambda data: b'\x93garbage' + data,
}


class Tiny:
    """A package with one kernel, which is imported anew as a new process would."""

    def __init__(self, folder: Path) -> None:
        self.name = f'tiny_{folder.name}'
        (folder / self.name).mkdir()
        (folder / self.name / '__init__.py').write_text(KERNEL)
        self._module = importlib.import_module(self.name)
        self.call()
        found = Path(self._module.one.stats.cache_path).glob('*.nb[ic]')
        self.files = {path.suffix: path for path in found}
        assert self.files.keys() == {'.nbi', '.nbc'}
        self.whole = {suffix: path.read_bytes() for suffix, path in self.files.items()}

    def call(self) -> bool:
        """Call the kernel and return whether it was in the cache."""
        importlib.reload(self._module)
        assert self._module.one() == 1
        return bool(self._module.one.stats.cache_hits)

    def damage(self, suffix: str, how: str) -> Path:
        """Damage a file of the cache and return it."""
        self.files[suffix].write_bytes(DAMAGES[how](self.whole[suffix]))
        return self.files[suffix]


@pytest.fixture
def tiny(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Tiny]:
    monkeypatch.syspath_prepend(tmp_path)
    made = Tiny(tmp_path)
    yield made
    del sys.modules[made.name]


@pytest.mark.parametrize('suffix', ['.nbi', '.nbc'])
@pytest.mark.parametrize('how', DAMAGES)
def test_a_damaged_file_is_named_removed_and_compiled_anew(
    tiny: Tiny, how: str, suffix: str, caplog: pytest.LogCaptureFixture
) -> None:
    path = tiny.damage(suffix, how)
    with pytest.raises((pickle.UnpicklingError, EOFError, ValueError)):
        tiny.call()
    assert mend_kernel_cache(tiny.name) == [path]
    assert caplog.messages == [
        f'{path} in the cache of compiled kernels is damaged and was removed: its kernel is '
        'compiled anew'
    ]
    assert not tiny.call()
    assert tiny.call()
    assert not is_damaged(path)


def test_a_whole_cache_is_left_alone_and_looked_at_once(tiny: Tiny) -> None:
    assert mend_kernel_cache(tiny.name) == []
    assert tiny.call()
    tiny.damage('.nbi', 'empty')
    assert mend_kernel_cache(tiny.name) == []


@pytest.mark.skipif(os.geteuid() == 0, reason='nothing can be kept from root')
def test_a_file_that_cannot_be_removed_is_an_error_that_says_so(tiny: Tiny) -> None:
    path = tiny.damage('.nbi', 'empty')
    path.parent.chmod(0o555)
    try:
        with pytest.raises(ConfigError, match=r'cannot be removed .* remove it'):
            mend_kernel_cache(tiny.name)
    finally:
        path.parent.chmod(0o755)


def test_pipelines_and_nodes_look_at_the_cache_before_they_call_a_kernel(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    class AskedError(Exception):
        pass

    def ask() -> None:
        raise AskedError

    monkeypatch.setattr('gait_segmentation.pipeline.mend_kernel_cache', ask)
    monkeypatch.setattr('gait_segmentation.kernels.mend_kernel_cache', ask)
    for call in (Pipeline, compile_kernels):
        with pytest.raises(AskedError):
            call()

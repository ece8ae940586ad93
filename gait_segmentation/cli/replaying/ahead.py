# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Iterators that work ahead in threads of their own."""

from __future__ import annotations

import queue
import threading
from collections.abc import Generator, Iterator
from dataclasses import dataclass
from typing import Any, TypeVar

__all__ = ['ahead']

Item = TypeVar('Item')

_POLL_S = 0.1


@dataclass(frozen=True)
class _End:
    """The end of the items, or the error that ended them."""

    error: BaseException | None = None


def ahead(items: Iterator[Item], depth: int = 4) -> Generator[Item, None, None]:
    """
    Yield the items of an iterator that runs in a thread, so that other work goes on meanwhile.

    The order stays the same, and an error of the iterator is raised where it occurred.

    :param depth: items that may wait.
    """
    ready: queue.Queue[Any] = queue.Queue(depth)
    given_up = threading.Event()

    def put(item: object) -> None:
        while not given_up.is_set():
            try:
                ready.put(item, timeout=_POLL_S)
            except queue.Full:
                continue
            return

    def run() -> None:
        try:
            for item in items:
                put(item)
                if given_up.is_set():
                    return
            put(_End())
        except BaseException as error:
            put(_End(error))
        finally:
            # A generator that is given up has things to close.
            if isinstance(items, Generator):
                items.close()

    thread = threading.Thread(target=run, name='ahead', daemon=True)
    thread.start()
    try:
        while True:
            item = ready.get()
            if isinstance(item, _End):
                if item.error is not None:
                    raise item.error
                return
            yield item
    finally:
        given_up.set()
        thread.join()

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The detector's process: which Python runs it, and images there and maps back."""

from __future__ import annotations

import math
import os
import shutil
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from importlib.util import find_spec
from pathlib import Path
from typing import IO, Any

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.detector.mediapipe_worker import HEAD, READY, REQUIREMENT
from gait_segmentation.errors import ConfigError, GaitSegmentationError
from gait_segmentation.images import check_image, shrink

DETECTORS = ('none', 'mediapipe')
"""What a detector may be asked for by."""

PYTHON = 'GAIT_DETECTOR_PYTHON'
"""Environment variable that names the Python to run the detector with."""

_WORKER = Path(__file__).with_name('mediapipe_worker.py')
_LARGEST_SIDE = 640
"""Images are scaled down to this before they are sent: the network looks at 256 x 256 pixels."""

_START_S = 60.0
_MAP_S = 10.0
_END_S = 2.0
_PAUSE_S = 1.0


class DetectorError(GaitSegmentationError):
    """The detector's process has not started, has ended, or does not answer."""


def detector_python() -> str:
    """
    Return the Python that is to run the detector.

    That is the one named by ``GAIT_DETECTOR_PYTHON``, this one if it has mediapipe, or that of the
    environment ``gait_segmentation/mediapipe`` in ``XDG_DATA_HOME`` (``~/.local/share``).

    :raises ConfigError: if there is none, with the commands that make the environment.
    """
    if given := os.environ.get(PYTHON):
        if shutil.which(given) is None:
            raise ConfigError(f'{PYTHON} must be a Python that has mediapipe, got {given}')
        return given
    if find_spec('mediapipe') is not None:
        return sys.executable
    data = os.environ.get('XDG_DATA_HOME') or os.path.expanduser('~/.local/share')
    environment = Path(data, 'gait_segmentation/mediapipe')
    python = environment / 'bin/python'
    if not os.access(python, os.X_OK):
        raise ConfigError(
            'no Python with mediapipe was found; to make one: '
            f'python3 -m venv {environment} && {environment}/bin/pip install {REQUIREMENT} '
            f'(or set {PYTHON})'
        )
    return str(python)


class Detector:
    """
    Where people are, by a network in a process of its own.

    The process is started with the first image, or before by :meth:`start`; should it end, it is
    started again with the next one, by a clock not within a second if it has answered no image.
    """

    def __init__(
        self, python: str | None = None, clock: Callable[[], float] | None = None
    ) -> None:
        """
        Find the Python to run it with; nothing is started.

        :param python: asked for by :func:`detector_python` if None.
        :param clock: seconds that never go back; without, there is no pause before a new start.
        :raises ConfigError: if there is none.
        """
        self._python = python or detector_python()
        self._process: subprocess.Popen[bytes] | None = None
        self._said: deque[str] = deque(maxlen=1)
        self._listener: threading.Thread | None = None
        self._clock = clock
        self._answered = False
        self._why, self._useless_s = '', -math.inf
        """What was wrong last, and when it last ended without an answer to any image."""

    def __enter__(self) -> Detector:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def start(self) -> None:
        """
        Start the process, unless it runs, and wait until it can answer.

        :raises DetectorError: if it does not, as without mediapipe; for a second after it has
            ended without an answer to any image nothing is tried, and the same is said again.
        """
        if self._process is not None:
            return
        if self._clock is not None and self._clock() - self._useless_s < _PAUSE_S:
            raise DetectorError(self._why)
        self._answered = False
        environment = dict(os.environ)
        if self._python != sys.executable:
            # Of another Python, whose packages it may not have before its own.
            environment.pop('PYTHONPATH', None)
            environment.pop('PYTHONHOME', None)
        pipe = subprocess.PIPE
        try:
            self._process = subprocess.Popen(
                [self._python, str(_WORKER)],
                stdin=pipe,
                stdout=pipe,
                stderr=pipe,
                env=environment,
                # Ctrl-C in a terminal is for whoever asks it.
                start_new_session=True,
            )
        except OSError as error:
            raise DetectorError(f'the detector cannot be run: {self._python}: {error}') from error
        self._said.clear()
        self._listener = threading.Thread(
            target=self._listen, args=[self._process.stderr], name='detector', daemon=True
        )
        self._listener.start()
        with self._answering(_START_S) as process:
            _read(process.stdout, len(READY))

    def map_of(self, image: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """
        Return P(person), 255 = certain, (h, w) uint8: of the whole image, at most 640 pixels long.

        :param image: (H, W, 3) uint8 BGR.
        :raises InputError: if it is no image.
        :raises DetectorError: if the process has ended or does not answer, see :meth:`start`.
        """
        check_image(image)
        self.start()
        scale = min(1.0, _LARGEST_SIDE / max(image.shape[:2]))
        height, width = (max(1, round(scale * side)) for side in image.shape[:2])
        rgb = cv2.cvtColor(shrink(image, (height, width)), cv2.COLOR_BGR2RGB)
        head = HEAD.pack(height, width)
        with self._answering(_MAP_S) as process:
            assert process.stdin is not None
            process.stdin.write(head + rgb.tobytes())
            process.stdin.flush()
            if _read(process.stdout, HEAD.size) != head:
                raise EOFError
            values = _read(process.stdout, height * width)
        self._answered = True
        return np.frombuffer(values, np.uint8).reshape(height, width)

    def close(self) -> None:
        """End the process, if it runs."""
        process, self._process = self._process, None
        if process is None:
            return
        assert process.stdin is not None
        # With which it ends by itself, in order.
        with suppress(OSError):
            process.stdin.close()
        try:
            process.wait(_END_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        if self._listener is not None:
            self._listener.join(_END_S)
        for stream in (process.stdout, process.stderr):
            if stream is not None:
                stream.close()

    reset = close
    """Forget what was seen."""

    @contextmanager
    def _answering(self, timeout_s: float) -> Iterator[subprocess.Popen[bytes]]:
        """
        Kill the process unless what is done with it is done in time.

        :raises DetectorError: if it ends meanwhile, with what it said last.
        """
        process = self._process
        assert process is not None
        late = threading.Event()

        def give_up() -> None:
            late.set()
            process.kill()

        timer = threading.Timer(timeout_s, give_up)
        timer.daemon = True
        timer.start()
        try:
            yield process
        except (OSError, EOFError) as error:
            # Not to wait for what will never end by itself.
            self.close()
            why = f'no answer within {timeout_s:g} s' if late.is_set() else ''
            why = why or (self._said[0] if self._said else f'exit code {process.returncode}')
            self._why = f'the detector ({self._python}) has ended: {why}'
            if self._clock is not None and not self._answered:
                self._useless_s = self._clock()
            raise DetectorError(self._why) from error
        finally:
            timer.cancel()

    def _listen(self, stream: IO[bytes]) -> None:
        """Keep what was said last, and have the process never wait for somebody to read it."""
        for line in stream:
            if text := line.decode(errors='replace').strip():
                self._said.append(text)


def _read(stream: Any, count: int) -> bytes:
    """
    Read so many bytes.

    :raises EOFError: if there are no more.
    """
    data = bytes(stream.read(count))
    if len(data) < count:
        raise EOFError
    return data

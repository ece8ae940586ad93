# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The detector's process: which Python runs it, and images there and maps back."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import threading
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.detector.mediapipe_worker import HEAD, READY, REQUIREMENT
from gait_segmentation.errors import ConfigError, DetectorError
from gait_segmentation.images import check_image, shrink

DETECTORS = ('none', 'mediapipe')
"""What a detector may be asked for by."""

PYTHON = 'GAIT_DETECTOR_PYTHON'
"""Environment variable that names the Python to run the detector with."""

_WORKER = Path(__file__).with_name('mediapipe_worker.py')
_LARGEST_SIDE = 640
"""Images are scaled down to this before they are sent: the network takes 256 x 256 pixels."""

_START_S = 60.0
_MAP_S = 10.0
_END_S = 2.0


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
    started again with the next one.
    """

    def __init__(self, python: str | None = None) -> None:
        """
        Find the Python to run it with; nothing is started.

        :param python: asked for by :func:`detector_python` if None.
        :raises ConfigError: if there is none.
        """
        self._python = python or detector_python()
        self._process: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> Detector:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def start(self) -> None:
        """
        Start the process, unless it runs, and wait until it can answer.

        :raises DetectorError: if it does not, as without mediapipe.
        """
        if self._process is not None:
            return
        environment = dict(os.environ)
        if self._python != sys.executable:
            # Of another Python, whose packages it may not have before its own.
            environment.pop('PYTHONPATH', None)
            environment.pop('PYTHONHOME', None)
        # A file, which never has the process wait for a reader.
        self._said = tempfile.TemporaryFile()  # noqa: SIM115
        try:
            self._process = subprocess.Popen(
                [self._python, str(_WORKER)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._said,
                env=environment,
                # Ctrl-C in a terminal is for whoever asks it.
                start_new_session=True,
            )
        except OSError as error:
            self._said.close()
            raise DetectorError(f'the detector cannot be run: {self._python}: {error}') from error
        self._ask(b'', len(READY), _START_S)

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
        answer = self._ask(head + rgb.tobytes(), HEAD.size + height * width, _MAP_S)
        return np.frombuffer(answer, np.uint8, offset=HEAD.size).reshape(height, width)

    def close(self) -> None:
        """End the process, if it runs."""
        if self._process is not None:
            self._end(self._process)

    def _end(self, process: subprocess.Popen[bytes]) -> str:
        """End the process; return what it said last, or its exit code."""
        self._process = None
        # With the end of its input it ends by itself, in order.
        try:
            process.communicate(timeout=_END_S)
        except (OSError, subprocess.TimeoutExpired):
            process.kill()
            process.wait()
            for stream in (process.stdin, process.stdout):
                with suppress(OSError):
                    stream.close()  # type: ignore[union-attr]
        with self._said:
            self._said.seek(0)
            said = self._said.read().decode(errors='replace').split('\n')
        return next(filter(str.strip, reversed(said)), f'exit code {process.returncode}')

    def _ask(self, question: bytes, count: int, timeout_s: float) -> bytes:
        """
        Return so many bytes that the process answers.

        :raises DetectorError: if it ends or is late, with what it said last.
        """
        process = self._process
        assert process is not None
        assert process.stdin is not None
        assert process.stdout is not None
        timer = threading.Timer(timeout_s, process.kill)
        timer.start()
        try:
            process.stdin.write(question)
            process.stdin.flush()
            answer = process.stdout.read(count)
        except OSError:
            answer = b''
        finally:
            late = timer.finished.is_set()
            timer.cancel()
        if len(answer) == count:
            return answer
        last = self._end(process)
        why = f'no answer within {timeout_s:g} s' if late else last
        raise DetectorError(f'the detector ({self._python}) has ended: {why}')

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What runs the networks of this package: ONNX Runtime if it is installed, else OpenCV."""

from __future__ import annotations

import gzip
import threading
from pathlib import Path
from types import ModuleType
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from gait_segmentation.errors import DetectorError, one_line


def onnx_runtime() -> ModuleType | None:
    """Return ONNX Runtime, None if it is not installed."""
    try:
        import onnxruntime
    except ImportError:
        return None
    return onnxruntime


def open_session(runtime: ModuleType, network: str | bytes) -> Any:
    """Return a session of ONNX Runtime for a file or its content, with OpenCV's threads."""
    options = runtime.SessionOptions()
    options.intra_op_num_threads = cv2.getNumThreads()
    # Threads that wait for work without sleeping take a core from the frames.
    options.add_session_config_entry('session.intra_op.allow_spinning', '0')
    # Patterns of the memory of each size of image would be kept.
    options.enable_mem_pattern = False
    options.log_severity_level = 4
    return runtime.InferenceSession(network, options, providers=['CPUExecutionProvider'])


class Engine:
    """A network with one input and one output; may be called by several threads."""

    def __init__(self, path: Path) -> None:
        """Load a gzip file of ONNX; DetectorError if it cannot be read."""
        self._lock, runtime = threading.Lock(), onnx_runtime()
        try:
            content = gzip.decompress(path.read_bytes())
            if runtime is not None:
                self._session = open_session(runtime, content)
                self._input = self._session.get_inputs()[0].name
            else:
                self._session = None
                self._net = cv2.dnn.readNetFromONNX(np.frombuffer(content, np.uint8))
        except Exception as error:
            # Both runtimes have errors of many types.
            engine = f'OpenCV {cv2.__version__}' if runtime is None else 'ONNX Runtime'
            raise DetectorError(
                f'{engine} cannot load {path} ({one_line(error)}); '
                'detector.network: none does without'
            ) from error

    def __call__(self, blob: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return what the network gives for a blob of one image, without its first axis."""
        if self._session is not None:
            return np.asarray(self._session.run(None, {self._input: blob})[0][0])
        with self._lock:
            self._net.setInput(blob)
            return np.asarray(self._net.forward()[0])

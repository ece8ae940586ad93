# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""gait_demo from end to end on a short synthetic film, and what can go wrong."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest

from test.walkers import box_of, clip

pytest.importorskip('rclpy', reason='needs ROS 2: rclpy cannot be imported')


ROOT = Path(__file__).parents[3]
TIMEOUT_S = 600.0
FRAMES = 16


@pytest.fixture(scope='module')
def film(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[str]]:
    """Return a folder of images and the options that name the person in the first."""
    folder = tmp_path_factory.mktemp('film')
    frames = clip(frames=FRAMES)
    for index, frame in enumerate(frames):
        cv2.imwrite(str(folder / f'{index:04d}.png'), frame.image)
    box = box_of(frames[0])
    return folder, ['--box', *(str(v) for v in (box.x, box.y, box.width, box.height))]


class Demo:
    """gait_demo as a process."""

    def __init__(self, film: tuple[Path, list[str]], out: Path, *more: str) -> None:
        command = [sys.executable, '-m', 'gait_tools.cli.demo', '--clip', str(film[0])]
        command += [*film[1], '--rate', '8', '--detector', 'none', '--out', str(out), *more]
        environment = {**os.environ, 'PYTHONPATH': f'{ROOT}:{ROOT}/tools'}
        environment.pop('ROS_DOMAIN_ID', None)
        self.process = subprocess.Popen(
            command,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            cwd=out.parent,
        )

    def finish(self) -> str:
        output, _ = self.process.communicate(timeout=TIMEOUT_S)
        return output

    def children(
        self, count: int = 3, names: str = 'gait_segmentation.nodes|gait_tools.demo.camera'
    ) -> list[str]:
        """Return the numbers of the processes that were started, once they are."""
        deadline = time.monotonic() + TIMEOUT_S
        command = ['pgrep', '-P', str(self.process.pid), '-f', names]
        while len(found := subprocess.run(command, capture_output=True).stdout.split()) < count:
            assert time.monotonic() < deadline
            assert self.process.poll() is None, self.finish()
            time.sleep(0.02)
        return [each.decode() for each in found]


def _wait_for_end(children: Iterable[str]) -> None:
    """Wait until processes are gone: what was just being started ends a moment after the demo."""
    deadline = time.monotonic() + 30
    while any(Path(f'/proc/{pid}').exists() for pid in children):
        assert time.monotonic() < deadline
        time.sleep(0.02)


def wait_for(demo: Demo, stamps: Path, frames: int) -> None:
    """Wait until the camera has shown so many frames."""
    while not stamps.exists() or len(stamps.read_text().splitlines()) < frames:
        assert demo.process.poll() is None, demo.finish()
        time.sleep(0.02)


@pytest.fixture
def demo(film, tmp_path: Path) -> Iterator[Demo]:
    made = Demo(film, tmp_path / 'out')
    yield made
    made.process.kill()
    made.process.wait()


def test_the_camera_stays_until_the_nodes_have_all_frames_and_everything_is_written(
    demo: Demo, film, tmp_path: Path
) -> None:
    # Most of the film is left when the tracker is stopped, as if others ran.
    (tracker,) = demo.children(1, 'tracker_node')
    (camera,) = demo.children(1, 'gait_tools.demo.camera')
    out = tmp_path / 'out'
    wait_for(demo, out / 'logs/stamps.txt', 1)
    os.kill(int(tracker), signal.SIGSTOP)
    wait_for(demo, out / 'logs/stamps.txt', FRAMES)
    # It would end at once if it did not wait.
    deadline = time.monotonic() + 2
    while time.monotonic() < deadline:
        assert Path(f'/proc/{camera}').exists()
        time.sleep(0.02)
    os.kill(int(tracker), signal.SIGCONT)
    output = demo.finish()
    assert demo.process.returncode == 0, output
    out = tmp_path / 'out'
    report = json.loads((out / 'report.json').read_text())
    latency = report.pop('latency_ms')
    assert set(report.values()) == {FRAMES}
    assert 0 < latency['p50'] <= latency['p95']
    assert f'{FRAMES} frames played, {FRAMES} answered, {FRAMES} with a silhouette' in output
    shown = re.findall(r'(?m)^(/.*?)  ', output)
    assert {Path(each).relative_to(out).name for each in shown} == {
        *('contact_sheet.png', 'overlay.mp4', 'animation.webp', 'masks')
    }
    assert all(Path(each).exists() for each in shown)
    names = sorted(path.name for path in (out / 'masks').iterdir())
    assert names == [f'{index:04d}.png' for index in range(FRAMES)]
    first = cv2.imread(str(film[0] / '0000.png'))
    mask = cv2.imread(str(out / 'masks/0000.png'), cv2.IMREAD_UNCHANGED)
    assert mask.shape == first.shape[:2]
    assert set(np.unique(mask)) == {0, 255}
    assert cv2.imread(str(out / 'contact_sheet.png')).std() > 5
    capture = cv2.VideoCapture(str(out / 'overlay.mp4'))
    assert capture.get(cv2.CAP_PROP_FRAME_COUNT) == FRAMES
    capture.release()


@pytest.mark.parametrize(
    ('number', 'code', 'said'),
    [(signal.SIGINT, 130, 'interrupted'), (signal.SIGKILL, -signal.SIGKILL, '')],
)
def test_whatever_ends_it_leaves_no_process_behind(
    demo: Demo, number: int, code: int, said: str
) -> None:
    children = demo.children()
    os.kill(demo.process.pid, number)
    output = demo.finish()
    assert demo.process.returncode == code
    assert said in output
    assert 'Traceback' not in output
    _wait_for_end(children)

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Parameters of the nodes that no stage knows of, and names of all: also for gait_replay."""

from __future__ import annotations

import difflib
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from gait_segmentation import MOST_PIXELS
from gait_segmentation.config import StageConfig, parameter
from gait_segmentation.errors import ConfigError, InputError
from gait_segmentation.geometry import Box

_ALIKE = 0.75
"""How alike names must be, from 0 to 1, for one to be taken for the other."""


@dataclass(frozen=True)
class NodeConfig(StageConfig):
    """Parameters of every node."""

    autostart: bool = parameter(
        True,
        'Configure and activate the node when it starts, instead of waiting for a life cycle '
        'manager.',
        read_only=True,
    )
    backlog: int = parameter(
        0,
        'Frames that may wait; when more come, all but the newest are dropped. 0 = for a camera: '
        '10 for a moment, and one while frames take longer than they come. Recordings want at '
        'least matching.lag, of which the frames come at once at the end.',
        unit='frames',
        minimum=0,
        maximum=1000,
    )
    num_threads: int = parameter(
        1,
        'Threads that OpenCV may use besides the ones of the node. 0 = as many as cores.',
        minimum=0,
        maximum=64,
        fixed=True,
    )


@dataclass(frozen=True)
class CameraConfig(StageConfig):
    """Parameters of nodes that subscribe to the camera."""

    reliability: str = parameter(
        'best_effort',
        'Reliability of the image subscription. best_effort takes the images of every camera, '
        'reliable only of those that publish so.',
        choices=('best_effort', 'reliable'),
        fixed=True,
    )
    image_transport: str = parameter(
        'raw',
        'raw = sensor_msgs/Image on image, compressed = sensor_msgs/CompressedImage (JPEG or '
        'PNG) on the topic that image is remapped to, with /compressed behind it.',
        choices=('raw', 'compressed'),
        fixed=True,
    )
    max_pixels: int = parameter(
        MOST_PIXELS,
        'Pixels that an image may have; decoding 64 megapixels takes 0.2 GB and a second. For '
        'compressed images with more, set OPENCV_IO_MAX_IMAGE_PIXELS as well.',
        unit='px',
        minimum=1,
        maximum=1 << 30,
    )
    sample_bits: int = parameter(
        16,
        'Bits of a sample that the camera uses in images of 16: some send 10, 12 or 14 as 16, and '
        'the images are too dark otherwise.',
        unit='bits',
        minimum=8,
        maximum=16,
    )


@dataclass(frozen=True)
class StartConfig(StageConfig):
    """Parameters of nodes that start tracks, also from detections (vision_msgs)."""

    initial_box: tuple[float, ...] = parameter(
        (0.0, 0.0, 0.0, 0.0),
        'Tight box of the person to track from the beginning: x and y of the top left corner, '
        'width and height. All zero = wait for init_roi.',
        unit='px',
        fixed=True,
    )
    initial_box_stamp: int = parameter(
        0,
        'Stamp of the frame that initial_box belongs to: it is applied at the first frame that '
        'is not earlier. 0 = the first frame.',
        unit='ns',
        minimum=0,
        fixed=True,
    )
    detection_class: str = parameter(
        'person', 'Class of the detections that start tracks. Empty = every class.'
    )
    detection_score: float = parameter(
        0.5, 'Least score of a detection that starts a track.', minimum=0.0, maximum=1.0
    )

    def __post_init__(self) -> None:
        """Refuse what makes no box, too."""
        super().__post_init__()
        self.box()

    def box(self) -> Box | None:
        """Return the box, None if there is none."""
        try:
            return Box(*self.initial_box) if any(self.initial_box) else None
        except InputError as error:
            raise ConfigError(f'initial_box: {error}') from error


@dataclass(frozen=True)
class SegmenterNodeConfig(StageConfig):
    """Parameters of the segmenter's node."""

    keep_images: int = parameter(
        40,
        'Images kept while they wait for their match. Must cover the lag of the matching and '
        'the frames in process.',
        unit='frames',
        minimum=2,
        maximum=1000,
        fixed=True,
    )


@dataclass(frozen=True)
class LocalizerNodeConfig(StageConfig):
    """Parameters of what the localization takes in."""

    ground_frame: str = parameter(
        '',
        'Frame of tf with z up and z = 0 on the ground, such as odom: gives the pose of the '
        'camera, also while it moves. Empty = localization.camera_height and camera_pitch do.',
        fixed=True,
    )
    rectified: bool = parameter(
        False,
        'The images are rectified: of camera_info P is meant, instead of K and D.',
        fixed=True,
    )
    depth_tolerance: float = parameter(
        0.05,
        'How far the stamps of an image and of its depth image may be apart.',
        unit='s',
        minimum=0.0,
        maximum=1.0,
    )


@dataclass(frozen=True)
class BankConfig(StageConfig):
    """Parameters of nodes that use the templates."""

    bank: str = parameter(
        '',
        'File of the template bank, as gait_bank writes it. Empty = the standard gait model.',
        fixed=True,
    )


OF_NODES: tuple[type[StageConfig], ...] = (
    NodeConfig,
    CameraConfig,
    StartConfig,
    SegmenterNodeConfig,
    LocalizerNodeConfig,
    BankConfig,
)
"""All of them."""


NODES = tuple(
    f'gait_{each}' for each in ('localizer', 'matcher', 'pipeline', 'segmenter', 'tracker')
)
"""The nodes of this package, which one parameter file may serve."""

_STAGES = ('detector', 'localization', 'matching', 'segmentation', 'starting', 'tracking')
"""What the parameters of their stages begin with."""


def sections_of(content: Any, path: str = '') -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield what a ROS parameter file says to nodes: name, without namespace, and parameters."""
    if isinstance(content, dict):
        given = content.get('ros__parameters')
        if isinstance(given, dict):
            yield path.rpartition('/')[2], given
        for key, inside in content.items():
            yield from sections_of(inside, f'{path}/{key}')


def qualified(group: str, name: str) -> str:
    """Return the ROS name of a parameter: those of a stage have its name in front."""
    return f'{group}.{name}' if group else name


def misnamed(given: Iterable[str], known: Collection[str]) -> dict[str, str]:
    """
    Return which parameters given to a node are probably meant to be others that it has.

    Those of other nodes are no mistake, as one file may serve all: only what claims to be of a
    stage of the node, or nearly has the name of a parameter.

    :returns: from each such name to the most similar one, empty if none is.
    """
    stages = {name.rpartition('.')[0] for name in known}
    found = {}
    for name in (each for each in given if each not in known):
        stage = name.rpartition('.')[0]
        if stage in set(_STAGES) - stages:
            continue
        alike = difflib.get_close_matches(name, known, n=1, cutoff=_ALIKE)
        if alike or (stage and stage in stages):
            found[name] = alike[0] if alike else ''
    return found

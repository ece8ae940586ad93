# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Outputs of gait_replay: what one is, and bags, masks, films, tables and silhouettes."""

from __future__ import annotations

import cmath
import contextlib
import csv
import fcntl
import math
import pickle
import re
import shutil
from abc import ABC, abstractmethod
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

import av
import cv2
import numpy as np
from av.error import FFmpegError
from numpy.typing import NDArray

from gait_segmentation.drawing import draw_label, draw_person
from gait_segmentation.errors import SequenceError
from gait_segmentation.files import film_name, named
from gait_segmentation.inputs import InputFrame
from gait_segmentation.pipeline import FrameResult, PersonResult
from gait_segmentation.streams.fields import (
    QUEUE_DEPTH,
    Corners,
    gait_joints,
    matched_corners,
    refined_corners,
    slot_topic,
    slot_topics,
    track_corners,
)

_STEPS_PER_STRIDE = 2

TABLE_COLUMNS = (
    *('frame', 'stamp_ns', 'slot', 'track_id', 'state'),
    *('box_x_px', 'box_y_px', 'box_width_px', 'box_height_px', 'tilt_rad', 'track_confidence'),
    *('gait_phase_strides', 'cadence_steps_per_min', 'azimuth_rad', 'match_confidence'),
    'mask_px',
)
"""One row a frame and person."""

_BOX = 'geometry_msgs/msg/PolygonInstanceStamped'
_IMAGE = 'sensor_msgs/msg/Image'
_GAIT = 'sensor_msgs/msg/JointState'
_SIZE = 'sensor_msgs/msg/RegionOfInterest'

_SLOT_TOPICS = {
    'box': _BOX,
    'likelihood': _IMAGE,
    'matched_box': _BOX,
    'refined_box': _BOX,
    'shape_prior': _IMAGE,
    'gait': _GAIT,
    'mask': _IMAGE,
}

_MARK = 'gait_replay'
"""Of the entry in the metadata that says who made a bag."""

_LEAST_FRAMES, _LEAST_SUM = 5, 10_000
"""Of a walk, and of the pixels (0/255) of a silhouette: OpenGait warns of less."""

_SILHOUETTE_PX = 64
"""Height and width of a silhouette in pixels."""


def partial_path(path: Path) -> Path:
    """Return where an output is while it is made, and is left if it is broken off."""
    return path.with_name(f'{path.stem}.partial{path.suffix}')


def remove(path: Path) -> None:
    """Remove a file or a folder, if it is there."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


@contextlib.contextmanager
def _alone(path: Path) -> Iterator[None]:
    """Keep other commands from a place; SequenceError if one is making something there."""
    lock = path.with_name(f'.{path.name}.lock')
    with lock.open('w') as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise SequenceError(f'{path} is being made by another command') from error
        except OSError:
            pass  # Some file systems of networks have no locks.
        try:
            yield
        finally:
            lock.unlink(missing_ok=True)


class Output(ABC):
    """
    A file or folder of results.

    It grows at :func:`partial_path`; :meth:`close` gives it its name, unless the replay was broken
    off.  It can be read in both cases.

    ``option`` of the command asks for it, of which ``help`` tells; ``default`` is where it goes if
    the option is not given, None if it is not wanted then.  ``suffix`` ends the name of a file
    where several inputs have one each in a folder, which with ``in_folder`` a single one has, too.
    ``files`` are those that an output may hold that is a folder, relative to it.
    """

    option: ClassVar[str]
    help: ClassVar[str]
    default: ClassVar[Path | None] = None
    suffix: ClassVar[str] = ''
    in_folder: ClassVar[bool] = False
    files: ClassVar[re.Pattern[str] | None] = None

    def __init__(
        self, path: Path, size: tuple[int, int] = (0, 0), fps: float = 0.0, slots: int = 1
    ) -> None:
        """
        Begin an empty output in place of what an earlier attempt left.

        :param size: width and height of the frames.
        :param slots: for people.
        :raises OSError: if it cannot be written.
        :raises SequenceError: if the place cannot be used, see :meth:`check`, or is in use.
        """
        self.check(path)
        path.parent.mkdir(parents=True, exist_ok=True)
        self.path, self.work = path, partial_path(path)
        self.size, self.fps, self.slots = size, fps, slots
        self._closed = False
        self._held = contextlib.ExitStack()
        self._held.enter_context(_alone(path))
        remove(self.work)
        try:
            with named(path):
                self.begin()
        except BaseException:
            remove(self.work)
            self._held.close()
            raise

    @classmethod
    def place(cls, given: Path, name: str, *, several: bool) -> Path:
        """Return where the output of the input ``name`` goes if the option says ``given``."""
        return given / f'{name}{cls.suffix}' if several or cls.in_folder else given

    @classmethod
    def is_there(cls, path: Path) -> bool:
        """Return whether something is there; an empty file or folder is nothing."""
        if path.is_dir():
            return any(path.iterdir())
        return path.exists() and not (path.is_file() and path.stat().st_size == 0)

    @classmethod
    def is_own(cls, path: Path) -> bool:
        """Return whether what is there, of the right names, is of this kind."""
        return True

    @classmethod
    def check(cls, path: Path) -> None:
        """Refuse a place, also where it is made, of something of another kind: SequenceError."""
        for place in (path, partial_path(path)):
            own = cls._has_names(place) and (place != path or cls.is_own(path))
            if cls.is_there(place) and not own:
                raise SequenceError(
                    f'{place} was not made by gait_replay and is not replaced: remove it or '
                    'choose another place'
                )

    @classmethod
    def _has_names(cls, path: Path) -> bool:
        """Return whether it is a file, or a folder of files with the right names, as it is to."""
        if cls.files is None or not path.is_dir():
            return cls.files is None and path.is_file()
        found = (each for each in path.rglob('*') if not each.is_dir())
        return all(cls.files.fullmatch(each.relative_to(path).as_posix()) for each in found)

    def begin(self) -> None:
        """Begin :attr:`work`, here an empty folder; SequenceError if it cannot be of that name."""
        self.work.mkdir()

    @abstractmethod
    def add(self, frame: InputFrame, result: FrameResult) -> None:
        """Add a frame and what was found in it; OSError if it cannot be written."""

    def finish(self) -> None:  # noqa: B027
        """Write what belongs to the end; here, nothing."""

    def close(self, *, complete: bool) -> None:
        """
        Finish, and give the output its name if it is complete; nothing if that was tried.

        :raises OSError: if it is to be complete and cannot be finished.
        :raises SequenceError: likewise.
        """
        if self._closed:
            return
        self._closed = True
        failures = () if complete else (OSError, SequenceError)
        with self._held, contextlib.suppress(*failures), named(self.path):
            self.finish()
            if complete:
                remove(self.path)
                self.work.replace(self.path)


class BagOutput(Output):
    """
    A rosbag2 (MCAP) with the topics and messages of the live graph.

    Messages are recorded at the time at which the source image was, so that both bags can be
    played or shown together.
    """

    option = '--out'
    help = 'bags (MCAP), one each, with the topics and messages of the live nodes (%(default)s)'
    default = Path('out/replay')
    in_folder = True
    files = re.compile(r'metadata\.yaml|[^/]+\.mcap')

    def begin(self) -> None:
        """Open the bag and declare the topics."""
        # Here, since other outputs do without rosbags.
        from rosbags import interfaces, rosbag2
        from rosbags.typesys import Stores, get_typestore

        self._store = get_typestore(Stores.ROS2_JAZZY)
        self._shape: tuple[int, ...] | None = None
        plugin = rosbag2.StoragePlugin.MCAP
        self._writer: Any = rosbag2.Writer(self.work, version=9, storage_plugin=plugin)
        self._writer.set_compression(
            rosbag2.CompressionMode.STORAGE, rosbag2.CompressionFormat.ZSTD
        )
        self._writer.set_custom_data(_MARK, 'complete')
        self._writer.open()
        # rosbags calls the file as the folder, which is going to be renamed.
        storage = self._writer.storage
        storage.path = storage.path.rename(self.work / f'{self.path.name}.mcap')
        topics = {'image_size': _SIZE, **slot_topics(_SLOT_TOPICS, self.slots)}
        topics |= {'mask': _IMAGE, 'labels': _IMAGE}
        forever = interfaces.QosTime(2147483647, 4294967295)
        durability = interfaces.QosDurability
        self._connections: dict[str, Any] = {}
        for topic, kind in topics.items():
            latched = topic == 'image_size'
            qos = interfaces.Qos(
                history=interfaces.QosHistory.KEEP_LAST,
                depth=1 if latched else QUEUE_DEPTH,
                reliability=interfaces.QosReliability.RELIABLE,
                durability=durability.TRANSIENT_LOCAL if latched else durability.VOLATILE,
                deadline=forever,
                lifespan=forever,
                liveliness=interfaces.QosLiveliness.AUTOMATIC,
                liveliness_lease_duration=forever,
                avoid_ros_namespace_conventions=False,
            )
            self._connections[topic] = self._writer.add_connection(
                f'/{topic}', kind, typestore=self._store, offered_qos_profiles=[qos]
            )

    @classmethod
    def is_own(cls, path: Path) -> bool:
        """Return whether the bag says so."""
        about = path / 'metadata.yaml'
        return about.is_file() and _MARK.encode() in about.read_bytes()

    def add(self, frame: InputFrame, result: FrameResult) -> None:
        """Write all messages of a frame."""
        # The header of the source image, bit for bit.
        time = self._made('builtin_interfaces/msg/Time', *divmod(frame.header_ns, 1_000_000_000))
        header = self._made('std_msgs/msg/Header', time, frame.frame_id)
        shape = result.mask.shape
        if shape != self._shape and frame.image is not None:
            self._shape = shape
            self._write('image_size', frame, 0, 0, *shape, False)
        for slot, person in enumerate(result.people):
            track, match = person.track, person.match
            names, *numbers = gait_joints(match)
            messages = {
                'box': self._polygon(track_corners(track), track.track_id),
                'likelihood': _image(track.likelihood),
                'matched_box': self._polygon(matched_corners(match), match.track_id),
                'refined_box': self._polygon(refined_corners(match), match.track_id),
                'shape_prior': _image(match.shape_prior),
                'gait': [list(names), *(np.array(each, np.float64) for each in numbers)],
                'mask': _image(person.segmentation.mask),
            }
            for name, fields in messages.items():
                self._write(slot_topic(slot, name), frame, header, *fields)
        self._write('mask', frame, header, *_image(result.mask))
        self._write('labels', frame, header, *_image(result.labels))

    def finish(self) -> None:
        """Write the index."""
        storage = self._writer.storage
        try:
            self._writer.close()
        except OSError:
            with contextlib.suppress(OSError):
                storage.bio.close()
            raise

    def _made(self, kind: str, *fields: Any) -> Any:
        return self._store.types[kind](*fields)

    def _polygon(self, corners: Corners, track_id: int) -> list[Any]:
        """Return the fields of a box but for its header."""
        points = [
            self._made('geometry_msgs/msg/Point32', float(x), float(y), 0.0) for x, y in corners
        ]
        polygon = self._made('geometry_msgs/msg/Polygon', points)
        return [self._made('geometry_msgs/msg/PolygonInstance', polygon, track_id)]

    def _write(self, topic: str, frame: InputFrame, *fields: Any) -> None:
        connection = self._connections[topic]
        message = self._made(connection.msgtype, *fields)
        data = self._store.serialize_cdr(message, connection.msgtype)
        self._writer.write(connection, frame.recorded_ns, data)


def _image(image: NDArray[np.uint8]) -> list[Any]:
    """Return the fields of a (H, W) uint8 image as mono8 but for its header."""
    height, width = image.shape
    return [height, width, 'mono8', 0, width, np.ascontiguousarray(image).reshape(-1)]


class MasksOutput(Output):
    """A folder with ``NNNN.png`` for every frame, named by its number in the input."""

    option = '--masks'
    help = "masks as NNNN.png (255 = person) by the frame's number in the input"
    files = re.compile(r'\d+\.png')

    @classmethod
    def is_own(cls, path: Path) -> bool:
        """Return whether all images are grey, as masks are and frames are not."""
        for each in path.iterdir():
            with each.open('rb') as file:
                # The signature, and after the size 8 bits of grey.
                head = file.read(26)
            if not head.startswith(b'\x89PNG') or head[24:] != b'\x08\0':
                return False
        return True

    def add(self, frame: InputFrame, result: FrameResult) -> None:
        """Write the mask of a frame."""
        if result.mask.size:
            data = cv2.imencode('.png', result.mask)[1].tobytes()
            (self.work / f'{frame.number:04d}.png').write_bytes(data)


class OverlayOutput(Output):
    """A film with outlines, boxes, directions and phases."""

    option = '--overlay'
    help = 'a film (.mp4) with outline, box, id, and of who walks direction and phase (strides)'
    suffix = '.mp4'

    @classmethod
    def is_own(cls, path: Path) -> bool:
        """Return whether it is a film as this class encodes them."""
        with contextlib.suppress(FFmpegError), av.open(film_name(path)) as film:
            codecs = [getattr(each.codec_context, 'name', '') for each in film.streams.video]
            return codecs == ['mpeg4']
        return False

    def begin(self) -> None:
        """Open the film; SequenceError if there is no encoder for the name."""
        self._frames = 0
        # OpenCV does not say why it cannot write: the disk may be full.
        self.work.write_bytes(bytes(4096))
        # No other backend: for a name it does not know OpenCV's next one throws, aloud.
        self._film = cv2.VideoWriter(
            film_name(self.work),
            cv2.CAP_FFMPEG,
            cv2.VideoWriter.fourcc(*'mp4v'),
            self.fps,
            self.size,
        )
        if not self._film.isOpened():
            raise SequenceError(
                f'{self.path} cannot be written as a film; use a name such as walk.mp4'
            )

    def add(self, frame: InputFrame, result: FrameResult) -> None:
        """Draw a frame and write it."""
        black = np.zeros((*self.size[::-1], 3), np.uint8)
        picture = black if frame.image is None else frame.image.copy()
        for person in result.people:
            if person.track.box is not None:
                draw_person(picture, person.segmentation.mask, person.track.box, person.match)
        draw_label(picture, f'{frame.number}', (4, 4))
        # Which is a copy, where it has the size.
        self._film.write(cv2.resize(picture, self.size, interpolation=cv2.INTER_AREA))
        self._frames += 1

    def finish(self) -> None:
        """Write the index, and count the frames, as OpenCV does not tell of a full disk."""
        self._film.release()
        capture = cv2.VideoCapture(film_name(self.work))
        readable = 0
        while capture.grab():
            readable += 1
        capture.release()
        if readable != self._frames:
            raise SequenceError(
                f'{self.path} must have {self._frames} frames, {readable} can be read: is the '
                'disk full?'
            )


class CsvOutput(Output):
    """A table of boxes, phases, cadences, directions and confidences."""

    option = '--csv'
    help = 'a table of boxes, phase, cadence, azimuth and confidence, a row a person and frame'
    suffix = '.csv'
    columns: ClassVar[tuple[str, ...]] = TABLE_COLUMNS
    begins: ClassVar[bytes] = rb'frame,stamp_ns,'

    @classmethod
    def is_own(cls, path: Path) -> bool:
        """Return whether it begins as such a table does."""
        with path.open('rb') as file:
            return re.match(cls.begins, file.readline(1000)) is not None

    def begin(self) -> None:
        """Begin the table."""
        self._file = open(self.work, 'w', encoding='ascii', newline='')  # noqa: SIM115
        self._table = csv.writer(self._file, lineterminator='\n')
        if self.columns:
            self._table.writerow(self.columns)

    def add(self, frame: InputFrame, result: FrameResult) -> None:
        """Write a row for each person."""
        for slot, person in enumerate(result.people):
            if person.track.track_id:
                self._table.writerow((frame.number, frame.stamp_ns, slot, *_row(person)))

    def finish(self) -> None:
        """Write everything out."""
        self._file.close()


class TracksOutput(CsvOutput):
    """Boxes and track ids in the format of MOTChallenge."""

    option = '--tracks'
    help = 'tracks as MOTChallenge has them: frame (from 1), id, x, y, width, height, score'
    suffix = '.txt'
    columns = ()
    begins = rb'\d+,\d+,.*,-1,-1,-1$'

    def add(self, frame: InputFrame, result: FrameResult) -> None:
        """Write a row for each person who is seen."""
        for person in result.people:
            box, score = person.track.box, person.track.confidence
            if box is not None:
                sides = (f'{side:.2f}' for side in (box.x, box.y, box.width, box.height))
                place = frame.number + 1, person.track.track_id
                self._table.writerow((*place, *sides, f'{score:.3f}', -1, -1, -1))


def _row(person: PersonResult) -> tuple[object, ...]:
    track, match = person.track, person.match
    box: tuple[object, ...] = ('',) * 6
    if track.box is not None:
        sides = (track.box.x, track.box.y, track.box.width, track.box.height)
        box = (*(f'{side:.2f}' for side in sides), f'{track.angle:.4f}', f'{track.confidence:.3f}')
    gait: tuple[object, ...] = ('',) * 4
    if match.body is not None:
        gait = (
            # Rounded, the end of a stride is the beginning of the next.
            f'{round(match.phase, 4) % 1:.4f}',
            f'{60 * _STEPS_PER_STRIDE * match.phase_rate:.1f}',
            f'{match.azimuth:.4f}',
            f'{match.confidence:.3f}',
        )
    pixels = int(np.count_nonzero(person.segmentation.mask))
    return (track.track_id, track.state, *box, *gait, pixels)


def centred_silhouette(mask: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """
    Cut a silhouette out, 64 pixels high and centred.

    The centre is the median of its mass over the columns; what lies further than 32 pixels from
    it is cut off.

    :param mask: (H, W) uint8 0/255, not empty.
    :returns: (64, 64) uint8, 0 to 255.
    """
    rows = np.flatnonzero(mask.any(axis=1))
    cut = mask[rows[0] : rows[-1] + 1]
    width = max(int(cut.shape[1] * _SILHOUETTE_PX / cut.shape[0]), 1)
    sized = np.asarray(cv2.resize(cut, (width, _SILHOUETTE_PX), interpolation=cv2.INTER_CUBIC))
    mass = sized.sum(axis=0, dtype=np.int64).cumsum()
    center = int(np.searchsorted(mass, mass[-1] / 2))
    padded = np.pad(sized, ((0, 0), (_SILHOUETTE_PX // 2, _SILHOUETTE_PX // 2)))
    return padded[:, center : center + _SILHOUETTE_PX]


class OpenGaitOutput(Output):
    """
    A folder with the walk of each track, as gait recognition reads it.

    The data sets of OpenGait and similar systems hold one pickled array a walk, at
    ``subject/type/view/view.pkl``.  Here the folder is the subject, the type the track, and the
    view the mean walking direction in the image, in degrees in steps of 45: 000 = to the right,
    090 = away from the camera, 180 = to the left, 270 = towards the camera.
    """

    option = '--opengait'
    help = (
        'walks for gait recognition as OpenGait reads them: arrays (N, 64, 64) uint8 in '
        'DIR/NAME/person-ID/VIEW/VIEW.pkl'
    )
    in_folder = True
    files = re.compile(r'person-\d+/\d{3}/\d{3}\.pkl')

    def begin(self) -> None:
        """Begin without walks."""
        super().begin()
        self._walks: dict[int, list[tuple[NDArray[np.uint8], complex]]] = {}

    @classmethod
    def is_there(cls, path: Path) -> bool:
        """Return whether something is there; an empty folder, too: nobody may walk."""
        return path.is_dir() or super().is_there(path)

    def add(self, frame: InputFrame, result: FrameResult) -> None:
        """Keep the silhouettes of all people, and where they walk."""
        for person in result.people:
            mask = person.segmentation.mask
            if person.track.track_id and int(mask.sum()) > _LEAST_SUM:
                seen = (centred_silhouette(mask), cmath.rect(1, person.match.azimuth))
                self._walks.setdefault(person.track.track_id, []).append(seen)

    def finish(self) -> None:
        """Write the walks that are long enough."""
        for track_id, seen in self._walks.items():
            if len(seen) >= _LEAST_FRAMES:
                silhouettes, directions = zip(*seen, strict=True)
                degrees = math.degrees(cmath.phase(sum(directions)))
                view = f'{round(degrees / 45) * 45 % 360:03d}'
                file = self.work / f'person-{track_id:03d}/{view}/{view}.pkl'
                file.parent.mkdir(parents=True, exist_ok=True)
                file.write_bytes(pickle.dumps(np.stack(silhouettes), protocol=4))


OUTPUTS: tuple[type[Output], ...] = (
    BagOutput,
    MasksOutput,
    OverlayOutput,
    CsvOutput,
    TracksOutput,
    OpenGaitOutput,
)
"""What an input can be replayed into; each has an option of the command."""

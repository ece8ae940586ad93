# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
What the stages publish, as tables: topic, type, and what makes a message of a result.

A message without subscribers is not made: of a frame's it would take a millisecond.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from geometry_msgs.msg import PolygonInstanceStamped, PoseWithCovarianceStamped
from numpy.typing import NDArray
from sensor_msgs.msg import CompressedImage, Image, JointState
from visualization_msgs.msg import ImageMarker, MarkerArray

from gait_segmentation.geometry import Box
from gait_segmentation.ros.messages import (
    Person,
    box_message,
    boxes_message,
    compressed_message,
    detection_types,
    gait_message,
    image_message,
    markers_message,
    people_message,
    pose_message,
    tracks_message,
    walk_message,
)
from gait_segmentation.streams.fields import (
    matched_corners,
    refined_corners,
    slot_topic,
    track_corners,
)

if TYPE_CHECKING:
    from std_msgs.msg import Header

    from gait_segmentation.localization import Location
    from gait_segmentation.results import MatchResult
    from gait_segmentation.ros.lifecycle import GaitNode


class Output(NamedTuple):
    """The type of a topic's messages, and what makes one of a result and a header."""

    kind: Any
    make: Callable[[Any, Header], Any]


Table = Mapping[str, Output]

_IMAGES: dict[Any, Callable[..., Any]] = {
    Image: image_message,
    CompressedImage: compressed_message,
}

_OF_TRACK = {
    'box': Output(
        PolygonInstanceStamped,
        lambda track, header: box_message(track_corners(track), track.track_id, header),
    ),
    'likelihood': Output(Image, lambda track, header: image_message(track.likelihood, header)),
}
_OF_MATCH = {
    'matched_box': Output(
        PolygonInstanceStamped,
        lambda match, header: box_message(matched_corners(match), match.track_id, header),
    ),
    'refined_box': Output(
        PolygonInstanceStamped,
        lambda match, header: box_message(refined_corners(match), match.track_id, header),
    ),
    'gait': Output(JointState, gait_message),
    'shape_prior': Output(Image, lambda match, header: image_message(match.shape_prior, header)),
}
_OF_MASK = {'mask': Output(Image, lambda found, header: image_message(found.mask, header))}
_OF_PLACE = {
    'pose': Output(PoseWithCovarianceStamped, pose_message),
    'walk': Output(JointState, walk_message),
}


class Outputs:
    """The publishers of a table, of which those are served that are listened to."""

    def __init__(self, node: GaitNode, table: Table) -> None:
        """Make the publishers."""
        self._topics = [
            (each, node.output(each.kind, topic), topic) for topic, each in table.items()
        ]

    def heard(self) -> set[str]:
        """Return the topics that have subscribers."""
        return {
            topic for _, publisher, topic in self._topics if publisher.get_subscription_count()
        }

    def publish(self, result: Any, header: Header) -> None:
        """Publish the messages of a result, but for those of which nothing is known."""
        for (_, make), publisher, _ in self._topics:
            if publisher.get_subscription_count():
                message = make(result, header)
                if message is not None:
                    publisher.publish(message)

    def publish_made(self, header: Header, make: Callable[..., Any], *about: Any) -> None:
        """Make a result and publish its messages, if there are subscribers."""
        if self.heard():
            self.publish(make(*about), header)

    def blank(self, shape: tuple[int, ...], header: Header) -> None:
        """Publish empty results; ``shape`` is that of the images, which are one message."""
        black: dict[Any, Any] = {}
        for (kind, _), publisher, _ in self._topics:
            if not publisher.get_subscription_count():
                continue
            if kind in _IMAGES and kind not in black:
                black[kind] = _IMAGES[kind](np.zeros(shape, np.uint8), header)
            publisher.publish(black.get(kind) or kind(header=header))


def track_topics(slots: int) -> Table:
    """Return the outputs of the tracks of all slots."""
    table, types = _of_slots(_OF_TRACK, slots), detection_types()
    if types is not None:
        make = partial(tracks_message, types=types)
        table['tracks'] = Output(types.Detection2DArray, make)
    return table


def match_topics(slots: int) -> Table:
    """Return the outputs of the matches of all slots."""
    return _of_slots(_OF_MATCH, slots)


def mask_topics(slots: int) -> Table:
    """Return the outputs of :class:`PeopleMasks`, first what most listen to."""
    return {
        'mask': Output(Image, lambda masks, header: image_message(masks.mask, header)),
        **_of_slots(_OF_MASK, slots, lambda masks, slot: masks.people[slot]),
        'labels': Output(Image, lambda masks, header: image_message(masks.labels, header)),
        'mask/compressed': Output(
            CompressedImage, lambda masks, header: compressed_message(masks.mask, header)
        ),
    }


def picture_topics() -> Table:
    """Return the outputs of a picture for people, (H, W, 3) uint8 BGR."""
    return {
        f'debug_image{suffix}': Output(kind, _IMAGES[kind])
        for suffix, kind in (('', Image), ('/compressed', CompressedImage))
    }


def people_topics(slots: int) -> Table:
    """Return the outputs of what :func:`seen` returns: places, and all people in one message."""
    makers = {'boxes': (ImageMarker, boxes_message), 'markers': (MarkerArray, markers_message)}
    types = detection_types()
    if types is not None:
        makers['people'] = (types.Detection2DArray, partial(people_message, types=types))
    all_people = {
        topic: Output(kind, partial(_of_everybody, make)) for topic, (kind, make) in makers.items()
    }
    return {**_of_slots(_OF_PLACE, slots, Seen.location), **all_people}


def _of_everybody(make: Callable[..., Any], found: Seen, header: Header) -> Any:
    return make(found.people, header)


class Seen(NamedTuple):
    """Who is seen in a frame, and what is known of the place of each slot, if anything is."""

    people: Sequence[Person] = ()
    locations: Sequence[Location | None] = ()

    def location(self, slot: int) -> Location | None:
        """Return the place of a slot, None if it is not known."""
        return self.locations[slot] if self.locations else None


def seen(
    matches: Sequence[MatchResult],
    masks: Sequence[NDArray[np.uint8]],
    locations: Sequence[Location | None],
) -> Seen:
    """Return who is seen, given what is known of each slot."""
    found = Seen(locations=locations)
    people = [
        Person(match, box, found.location(slot))
        for slot, (match, mask) in enumerate(zip(matches, masks, strict=True))
        if match.body is not None and (box := Box.around(mask)) is not None
    ]
    return found._replace(people=people)


def _of_slots(
    table: Table, slots: int, choose: Callable[[Any, int], Any] = lambda results, k: results[k]
) -> dict[str, Output]:
    """Return the outputs of all slots; ``choose`` returns what is known of one, perhaps None."""

    def of_slot(make: Callable[..., Any], slot: int, results: Any, header: Header) -> Any:
        result = choose(results, slot)
        return None if result is None else make(result, header)

    return {
        slot_topic(slot, name): Output(each.kind, partial(of_slot, each.make, slot))
        for slot in range(slots)
        for name, each in table.items()
    }

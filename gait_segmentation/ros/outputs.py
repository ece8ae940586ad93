# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
What the stages publish, as tables: by topic the type, and what makes a message of a result.

A message without subscribers is not made: of a frame's it would take a millisecond.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

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

Table = dict[str, tuple[Any, Callable[[Any, Any], Any]]]

_IMAGES: Mapping[Any, Callable[..., Any]] = {
    Image: image_message,
    CompressedImage: compressed_message,
}


class Outputs:
    """The publishers of a table, of which those are served that are listened to."""

    def __init__(self, node: GaitNode, table: Table) -> None:
        """Make the publishers."""
        self._topics = [
            (kind, make, node.output(kind, topic)) for topic, (kind, make) in table.items()
        ]

    def publish(self, result: Any, header: Header) -> None:
        """Publish the messages of a result, but for those of which nothing is known."""
        for _, make, publisher in self._topics:
            if publisher.get_subscription_count():
                message = make(result, header)
                if message is not None:
                    publisher.publish(message)

    def publish_made(self, header: Header, make: Callable[..., Any], *about: Any) -> None:
        """Make a result and publish its messages, if there are subscribers."""
        if any(publisher.get_subscription_count() for _, _, publisher in self._topics):
            self.publish(make(*about), header)

    def blank(self, shape: tuple[int, ...], header: Header) -> None:
        """Publish empty results; ``shape`` is that of the images, which are one message."""
        black: dict[Any, Any] = {}
        for kind, _, publisher in self._topics:
            if not publisher.get_subscription_count():
                continue
            if kind in _IMAGES and kind not in black:
                black[kind] = _IMAGES[kind](np.zeros(shape, np.uint8), header)
            publisher.publish(black.get(kind) or kind(header=header))


def track_topics(slots: int) -> Table:
    """Return the outputs of the tracks of all slots."""
    table = _of_slots(
        slots,
        {
            'box': (
                PolygonInstanceStamped,
                lambda track, header: box_message(track_corners(track), track.track_id, header),
            ),
            'likelihood': (Image, lambda track, header: image_message(track.likelihood, header)),
        },
    )
    if types := detection_types():
        table['tracks'] = (types.Detection2DArray, partial(tracks_message, types=types))
    return table


def match_topics(slots: int) -> Table:
    """Return the outputs of the matches of all slots."""
    return _of_slots(
        slots,
        {
            'matched_box': (
                PolygonInstanceStamped,
                lambda match, header: box_message(matched_corners(match), match.track_id, header),
            ),
            'refined_box': (
                PolygonInstanceStamped,
                lambda match, header: box_message(refined_corners(match), match.track_id, header),
            ),
            'gait': (JointState, gait_message),
            'shape_prior': (Image, lambda match, header: image_message(match.shape_prior, header)),
        },
    )


def mask_topics(slots: int) -> Table:
    """Return the outputs of :class:`PeopleMasks`, first what most listen to."""
    own: Table = {'mask': (Image, lambda found, header: image_message(found.mask, header))}
    return {
        **own,
        **_of_slots(slots, own, lambda masks, slot: masks.people[slot]),
        'labels': (Image, lambda masks, header: image_message(masks.labels, header)),
        'mask/compressed': (
            CompressedImage,
            lambda masks, header: compressed_message(masks.mask, header),
        ),
    }


def picture_topics() -> Table:
    """Return the outputs of a picture for people, (H, W, 3) uint8 BGR."""
    return {
        'debug_image': (Image, image_message),
        'debug_image/compressed': (CompressedImage, compressed_message),
    }


def people_topics(slots: int) -> Table:
    """Return the outputs of what :func:`seen` returns: places, and all people in one message."""
    table = _of_slots(
        slots,
        {'pose': (PoseWithCovarianceStamped, pose_message), 'walk': (JointState, walk_message)},
        lambda found, slot: found[1][slot],
    )
    table['boxes'] = ImageMarker, lambda found, header: boxes_message(found[0], header)
    table['markers'] = MarkerArray, lambda found, header: markers_message(found[0], header)
    if types := detection_types():
        table['people'] = (
            types.Detection2DArray,
            lambda found, header: people_message(found[0], header, types),
        )
    return table


Seen = tuple[Sequence[Person], Sequence['Location | None']]
"""Who is seen in a frame, and the place of each slot as far as it is known."""


def seen(
    matches: Sequence[MatchResult],
    masks: Sequence[NDArray[np.uint8]],
    locations: Sequence[Location | None],
) -> Seen:
    """Return who is seen, given what is known of each slot."""
    people = [
        Person(match, box, location)
        for match, mask, location in zip(matches, masks, locations, strict=True)
        if match.body is not None and (box := Box.around(mask)) is not None
    ]
    return people, locations


def _of_slots(
    slots: int,
    table: Table,
    choose: Callable[[Any, int], Any] = lambda results, slot: results[slot],
) -> Table:
    """Return the outputs of all slots; ``choose`` returns what is known of one, perhaps None."""

    def of_slot(make: Callable[..., Any], slot: int, results: Any, header: Header) -> Any:
        result = choose(results, slot)
        return None if result is None else make(result, header)

    return {
        slot_topic(slot, name): (kind, partial(of_slot, make, slot))
        for slot in range(slots)
        for name, (kind, make) in table.items()
    }

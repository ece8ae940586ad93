# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Everybody who is followed, and who of them is published."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from itertools import combinations

from gait_segmentation.detector.detection import SAME_PERSON, Detection, associate
from gait_segmentation.geometry import Box
from gait_segmentation.results import LOST, TRACKED
from gait_segmentation.scene.scene import Regions, Scene, View
from gait_segmentation.tracking.pose import WIDEST_BODY
from gait_segmentation.tracking.reidentification import found_in
from gait_segmentation.tracking.tentative import Tentative, follow
from gait_segmentation.tracking.track import Track

ENDED = 'ended'
"""State of a track whose slot is free again."""

_LOST_FRAMES = 2
"""Frames in a row in which too little is seen after which a person is lost."""

GAP_S = 0.5
"""Time between two frames from which on no one is followed from one to the other."""

_MOST_BESIDE = 4
"""Most people without a slot whose pixels are followed."""

_NEAR, _AWAY = 0.4, 0.8
"""How far beside somebody with a slot others are followed from, and until, in body heights."""

_SHORTEST, _TALLEST = 0.5, 2.0
"""Height of somebody without a slot over that of who is near."""

_NEARER = 2.0
"""Height over that of the smallest with a slot from which somebody without one has theirs."""

_LOST_S = 1.0
"""Time for which somebody without a slot is looked for who is out of sight, in seconds."""


@dataclass
class People:
    """
    The tracks, and the tentative ones of whom no pixels are known.

    Of the tracks ``slots`` may be published, each in a slot of its own; ``reasons`` say by slot
    why the track is lost, or the last one of an empty slot has ended.
    """

    slots: int
    tracks: list[Track] = field(default_factory=list)
    tentative: list[Tentative] = field(default_factory=list)
    reasons: list[str] = field(init=False)

    def __post_init__(self) -> None:
        """Begin with empty slots."""
        self.reasons = [''] * self.slots

    @property
    def by_slot(self) -> list[Track | None]:
        """Return who is published in each slot."""
        found: list[Track | None] = [None] * self.slots
        for track in self.tracks:
            if track.slot is not None:
                found[track.slot] = track
        return found

    @property
    def published(self) -> list[Track]:
        """Return who has a slot, in the order of the slots."""
        return [track for track in self.by_slot if track is not None]

    @property
    def tracked(self) -> list[Track]:
        """Return who is tracked and not lost, with a slot or without one."""
        return [track for track in self.tracks if track.state == TRACKED]

    @property
    def lost(self) -> list[Track]:
        """Return who has a slot and is lost."""
        return [track for track in self.published if track.state == LOST]

    @property
    def doubted(self) -> list[Track]:
        """Return who has a slot, and is lost or was not seen at the last look."""
        return [each for each in self.published if each.state == LOST or each.existence.missed]

    @property
    def bodies(self) -> tuple[list[Box], list[Box]]:
        """
        Return the bodies of who is known to a map, no wider than one, and of who is lost.

        Whoever is lost without a slot counts as known: only their pixels are looked for.
        """
        lost = self.lost
        known = [slim(track.body) for track in self.tracks if track not in lost]
        return known, [track.body for track in lost]

    @property
    def known_since_ns(self) -> int:
        """Return the stamp from which on it is known where everybody was, 0 = all the time."""
        return max((track.history.known_since_ns for track in self.tracks), default=0)

    @property
    def views(self) -> list[View]:
        """Return the views that they are tracked in."""
        return list(dict.fromkeys(track.view for track in self.tracks))

    def seen_in(self, view: View) -> list[Track]:
        """Return who is followed in a view: those with a slot first, in their order."""
        here = (track for track in self.tracks if track.view is view)
        return sorted(here, key=lambda track: (track.slot is None, track.slot or 0))

    def regions(self, view: View) -> Regions:
        """Return where they were in the last frame of a view."""
        areas = tuple(track.pose.area for track in self.seen_in(view))
        return Regions(areas, any(track.view is view for track in self.lost))

    def is_missing(self, stamp_ns: int, *, others: bool) -> bool:
        """
        Return whether anybody is lost or was not seen at the last look, or nobody is there.

        :param others: whether others may begin: who may be new is missing as well, and people who
            are near each other may be taken for one another.
        """
        if not self.published or self.doubted:
            return True
        if not others:
            return False
        near = any(_are_near(*pair) for pair in combinations(self.tracks, 2))
        return near or bool(self.unsure(stamp_ns))

    def has_small(self, height: float, *, others: bool) -> bool:
        """Return whether anybody below a height, in source pixels, is there, or may come."""
        room = others and len(self.published) < self.slots
        return room or any(track.body.height < height for track in self.published)

    def unsure(self, stamp_ns: int) -> list[Box]:
        """Return where somebody may be, in source pixels, if there is room; likeliest first."""
        if len(self.published) >= self.slots:
            return []
        waiting = [each for each in self.tentative if each.may_be(stamp_ns)]
        waiting.sort(key=lambda each: -each.existence.log_odds(stamp_ns))
        return [each.detection.box for each in waiting]

    def near(self, box: Box, *, by_map: bool) -> Track | None:
        """
        Return beside whom somebody in a box, in source pixels, is to be followed, if any.

        :param by_map: whether a map shows them; it tells that if it shows all who are near.
        """
        if sum(track.slot is None for track in self.tracks) >= _MOST_BESIDE:
            return None
        found = [track for track in self.published if _is_near(box, track)]
        if by_map and not all(track.is_shown for track in found):
            return None
        return next(iter(found), None)

    def slot_for(self, box: Box, taken: Iterable[Track]) -> int:
        """
        Return the slot that a box begins: that of the same person, a free one, or any.

        :param taken: who has just begun.
        """
        begun = set(taken)
        old = [track for track in self.published if track not in begun]
        pairs = associate([[box]], [Detection(track.box, 1.0) for track in old])
        if pairs:
            return old[pairs[0]].slot or 0
        if None in self.by_slot:
            return self.by_slot.index(None)
        return min(old or self.published, key=lambda track: track.confidence).slot or 0

    def add(self, track: Track) -> None:
        """Take in a track; who had its id, or was followed there without a slot, was this one."""
        self.tracks = [
            other
            for other in self.tracks
            if other.track_id != track.track_id
            and (
                other.slot is not None
                or other.view is not track.view
                or other.pose.box.iou(track.pose.box) < SAME_PERSON
            )
        ]
        self.tracks.append(track)

    def free(self, slot: int) -> None:
        """Let go of who is in a slot."""
        self.tracks = [track for track in self.tracks if track.slot != slot]

    def live(self, stamp_ns: int, gap_s: float = 0.0) -> None:
        """
        Let every track go over to its next state, and go on with those that do not end.

        :param gap_s: see :func:`.next_state`.
        """
        alive, published = [], self.published
        for track in self.tracks:
            state, reason = next_state(track, stamp_ns, gap_s=gap_s)
            on_trial = track.existence.is_on_trial(stamp_ns)
            if track.slot is not None:
                self.reasons[track.slot] = reason
                if state == ENDED and on_trial:
                    # Followed on without the slot, whoever has only stood has it when they move.
                    track.publish(None)
                    state, reason = TRACKED, ''
            elif gap_s or not (on_trial or _is_needed(track, published)):
                state = ENDED
            if state != ENDED:
                track.enter(state, reason)
                alive.append(track)
            elif track.existence.evidence(stamp_ns) < 0:
                self.tentative.append(Tentative.rejected_of(track, stamp_ns))
        self.tracks = alive

    def reunite(self) -> None:
        """Let who is lost go on as the track that has found them without a slot."""
        for lost in self.lost:
            others = [each for each in self.tracked if each.slot is None]
            found = found_in(lost, others)
            if found is not None:
                self.tracks.remove(lost)
                found.succeed(lost)

    def number(self, stamp_ns: int) -> None:
        """Give slots to people who are followed without one, the tallest first."""
        waiting = [track for track in self.tracked if track.slot is None]
        for track in sorted(waiting, key=lambda each: -each.body.height):
            if track.existence.is_person(stamp_ns) and self.has_room(track.body.height):
                track.publish(self.make_room())

    def has_room(self, height: float) -> bool:
        """
        Return whether there is a slot for somebody of a height in source pixels.

        Of several slots that of somebody much smaller is one; one alone stays with whom it has.
        """
        heights = [track.body.height for track in self.published]
        return len(heights) < self.slots or (self.slots > 1 and height > _NEARER * min(heights))

    def make_room(self) -> int:
        """Return a free slot; if there is none, the smallest is followed on without theirs."""
        if None not in self.by_slot:
            min(self.published, key=lambda track: track.body.height).publish(None)
        return self.by_slot.index(None)

    def follow(
        self,
        others: Sequence[Detection],
        then_ns: int,
        by_map: Sequence[Detection],
        scene: Scene,
        moves: Callable[[Box], bool],
    ) -> list[Tentative]:
        """
        Go on with tentative tracks by detections of nobody who is tracked.

        :param others: by a detector, in the frame of ``then_ns``.
        :param by_map: by a heat map, in the newest frame of the scene.
        :param moves: whether somebody moves in a box, in source pixels.
        :returns: those who were detected, whom to :meth:`wait` for unless they begin.
        """
        longest = max(scene.source)
        known = [each for each in self.tentative if not each.is_over(scene.stamp_ns)]
        for view in scene.views[:1]:
            motion = view.now.motion.scaled(1 / view.scale, 1 / view.scale)
            known = [each.carried(motion) for each in known]
        found, known = follow(known, others, then_ns, longest, moves)
        more, self.tentative = follow(known, by_map, scene.stamp_ns, longest, moves)
        return [*found, *more]

    def wait(self, others: Iterable[Tentative]) -> None:
        """Keep tentative tracks that have not begun."""
        self.tentative.extend(others)


def _is_near(box: Box, track: Track) -> bool:
    """Return whether a box, in source pixels, may be of a person beside a track."""
    here = box.scaled(track.view.scale)
    alike = _SHORTEST < here.height / track.pose.height < _TALLEST
    return alike and _is_within(here, track, _NEAR)


def _is_needed(track: Track, published: Iterable[Track]) -> bool:
    """Return whether somebody without a slot is there, and near somebody who has one."""
    if track.existence.is_gone or (track.state == LOST and track.lost_s > _LOST_S):
        return False
    return any(_are_near(track, other) for other in published)


def _are_near(one: Track, other: Track) -> bool:
    """Return whether two people in the same view are so near that each is to be followed."""
    return one.view is other.view and _is_within(one.pose.box, other, _AWAY)


def _is_within(box: Box, track: Track, heights: float) -> bool:
    """Return whether a box, in pixels of the view, comes so near to a person, in heights."""
    margin = heights * track.pose.height
    return track.pose.area.padded(margin, margin).iou(box) > 0


def slim(body: Box) -> Box:
    """Return a body no wider than one: another person may be beside it."""
    width = min(body.width, WIDEST_BODY * body.height)
    return Box.from_center(body.center_x, body.center_y, width, body.height)


def next_state(track: Track, stamp_ns: int, *, gap_s: float = 0.0) -> tuple[str, str]:
    """
    Return the state of a track from now on, and why; nothing else decides over it.

    What cannot be a person by all that is known, see :class:`.Existence`, is ended. A tracked
    person is lost in a gap, outside of the image, when they are rather not there, and when too
    little is seen in two frames in a row. A lost person is tracked again when they are found and
    rather there, and ended when they are not for so long as ``patience`` says.

    :param stamp_ns: of the newest frame.
    :param gap_s: seconds without a frame before that.
    """
    lost, existence = track.state == LOST, track.existence
    doubt = existence.doubt(stamp_ns)
    if existence.evidence(stamp_ns) < 0:
        # Of somebody who is not published nobody asks that yet.
        if track.slot is not None:
            return ENDED, doubt
        doubt = ''
    if gap_s > GAP_S:
        return LOST, f'no frame came for {gap_s:.1f} s'
    if lost and track.found and not doubt:
        return TRACKED, ''
    if lost and track.lost_s > track.config.patience:
        return ENDED, f'not found for {track.lost_s:.1f} s'
    if lost:
        return LOST, track.reason
    if doubt:
        return LOST, doubt
    if track.is_outside:
        return LOST, 'outside of the image'
    if track.unseen_frames >= _LOST_FRAMES:
        return LOST, 'hidden, or not distinct from the surroundings'
    return TRACKED, ''

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Who is found by the walk, and which slot they get."""

from collections.abc import Sequence
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from gait_segmentation.errors import InputError
from gait_segmentation.gait_model import default_bank
from gait_segmentation.geometry import Box
from gait_segmentation.heat_maps import HeatMap
from gait_segmentation.results import LOST, TRACKED
from gait_segmentation.scene.scene import Scene, View
from gait_segmentation.starting.map_finder import MapFinder
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.initialization import estimate_first, slot_for_found
from gait_segmentation.tracking.life_cycle import Probation
from test.tracking.figures import GREEN, RED, STEP_NS, Figure, Told, ids, picture, step, walk
from test.walkers import small_bank

ON_TRIAL = 77
"""Frames until it is settled whether somebody found is a person."""


class Finder:
    """Finds whom it is told to, and remembers when it was asked."""

    def __init__(self) -> None:
        self.boxes: list[Box] = []
        self.asked: list[list[Box]] = []
        self.tried: list[Box] = []
        self.rejected: list[Box] = []
        self.wanted = True

    def update(
        self,
        scene: Scene,
        occupied: Sequence[Box],
        *,
        tried: Sequence[Box],
        wanted: bool,
    ) -> list[Box]:
        self.asked.append(list(occupied))
        self.tried = list(tried)
        self.wanted = wanted
        found, self.boxes = self.boxes, []
        return found

    def evidence(self, box: Box) -> float:
        return 1.0

    def reject(self, box: Box) -> None:
        self.rejected.append(box)

    background = None
    """Nothing is known of the place."""

    def find(self, figure: Figure) -> None:
        self.boxes.append(figure.box)

    def reset(self) -> None:
        """Have nothing to forget."""


@pytest.fixture
def finder(monkeypatch: pytest.MonkeyPatch) -> Finder:
    """Return the finder of all trackers that are made."""
    made = Finder()
    monkeypatch.setattr('gait_segmentation.tracking.tracker.WalkerFinder', lambda *_: made)
    return made


@pytest.mark.parametrize('slots', [1, 2])
def test_people_found_get_free_slots_and_are_told_to_the_finder(
    finder: Finder, slots: int
) -> None:
    told = Told(slots, 'motion')
    assert ids(told.show(Figure(60))) == [0] * slots
    finder.find(Figure(60))
    for figure in step([Figure(60)] * ON_TRIAL):
        assert ids(told.show(figure)) == [1, 0][:slots]
    finder.asked.clear()
    told.show(Figure(60))
    # Without a free slot nobody is looked for.
    assert len(finder.asked) == slots - 1
    for (occupied,) in finder.asked:
        assert occupied.iou(Figure(60).box) > 0.7


@pytest.mark.parametrize('fits', [False, True])
def test_who_was_found_leaves_the_slot_after_a_second_without_the_shape_of_a_body(
    finder: Finder, fits: bool
) -> None:
    told = Told(1, 'motion')
    figures = step(walk(Figure(60), 40))
    finder.find(figures[0])
    slots = []
    for number, figure in enumerate(figures):
        image, (mask,) = picture([figure])
        body = mask.copy()
        if not fits:
            body[: round(figure.y)] = 0
        slots += ids(told.see(image, [mask], [body]))
        if number == 10:
            # Until then it is looked at all the same.
            assert finder.asked[-1] == []
            (box,) = finder.tried
            assert box.iou(figure.box) > 0.4
    assert slots == ([1] * 40 if fits else [1] * 25 + [0] * 15)
    assert len(finder.rejected) == (0 if fits else 1)


def test_nobody_is_looked_for_once_boxes_are_given_until_a_reset(finder: Finder) -> None:
    told = Told(2, 'motion')
    told.tracker.initialize(Box(500, 10, 20, 50))
    with pytest.raises(InputError):
        told.show(Figure(60))
    # Not even by one that is refused.
    told.show(Figure(60))
    assert finder.wanted
    finder.asked.clear()
    told.start(Figure(60))
    told.show(Figure(60))
    assert finder.asked == [] or not finder.wanted
    finder.asked.clear()
    told.show(Figure(60))
    assert finder.asked == []
    told.tracker.reset()
    told.show(Figure(60))
    assert finder.wanted


@pytest.mark.parametrize('auto', ['none', 'motion'])
def test_a_box_starts_before_what_the_camera_has_seen(auto: str) -> None:
    board, figure = (75, 125), Figure(60)
    image, (mask,) = picture([figure], boards=[board])
    box = Box.around(mask)

    def first_mask(frames: int) -> np.ndarray:
        told = Told(1, auto)
        for _ in range(frames):
            told.show(boards=[board])
        told.tracker.initialize(Box(box.x, box.y, board[1] - box.x, box.height))
        told.tracker.update(image, told.stamp_ns)
        (track,) = told.tracker.tracks()
        return cv2.resize(track.mask.image, image.shape[1::-1])

    # Half of the box is a board, which was there before.
    wrong = [np.count_nonzero((first_mask(n) > 127) != (mask > 0)) for n in (0, 15)]
    assert wrong[1] < 0.5 * wrong[0]


@pytest.mark.parametrize(('coat', 'track_id'), [(RED, 1), (GREEN, 2)])
def test_somebody_found_is_the_lost_one_only_in_the_same_clothes(
    finder: Finder, coat: tuple[int, int, int], track_id: int
) -> None:
    told = Told(1, 'motion', patience=5.0)
    out = walk(Figure(260), 25, 4.0)
    finder.find(out[0])
    for figure in out:
        (result,) = told.show(figure)
    for _ in range(5):
        (result,) = told.show()
    assert (result.state, result.track_id) == ('lost', 1)
    # Far from where the first has left.
    finder.find(Figure(60, coat))
    (result,) = told.show(Figure(60, coat))
    assert (result.state, result.track_id) == ('tracked', track_id)


def test_of_those_who_are_lost_the_one_lost_longest_makes_room() -> None:
    lost = [
        SimpleNamespace(state=LOST, lost_s=s, similarity=lambda *_: 0.0) for s in (1.0, 3.0, 2.0)
    ]
    seen = SimpleNamespace(state=TRACKED)
    view = SimpleNamespace(now=None)
    assert slot_for_found([seen, *lost], view, None) == (2, None)
    assert slot_for_found([*lost, None], view, None) == (3, None)
    assert slot_for_found([seen], view, None) is None


def test_people_are_found_in_the_heat_map_of_a_frame_and_not_in_a_late_one() -> None:
    told, (image, _) = Told(1, 'motion'), picture([])
    template, heat = small_bank().templates[0, 0], np.zeros(image.shape[:2], np.uint8)
    heat[40 : 40 + template.shape[0], 100 : 100 + template.shape[1]] = template
    for number in range(1, 4):
        assert ids(told.tracker.update(image, number * STEP_NS)) == [0]
        # It comes when its frame is past.
        told.tracker.add_heat_map(heat, number * STEP_NS)
    assert ids(told.tracker.update(image, 4 * STEP_NS, heat)) == [1]


SOURCE = (240, 320)


def body(size=(30, 60), phase=0):
    """Return a template, (h, w) uint8."""
    template = default_bank().templates[0, phase]
    x, y, w, h = cv2.boundingRect(template)
    return np.where(cv2.resize(template[y : y + h, x : x + w], size) > 127, 255, 0)


def heat(number, *regions):
    """Return the map of a frame at half the size of the source, with regions (left, top, what)."""
    values = np.zeros((120, 160), np.uint8)
    for left, top, region in regions:
        values[top : top + region.shape[0], left : left + region.shape[1]] = region
    return HeatMap(values, 1 + number)


def test_people_are_found_at_once_by_the_shape_of_a_body():
    finder = MapFinder(default_bank())
    regions = (20, 30, body()), (90, 20, body((36, 80), 8))
    found = finder.update(heat(0, *regions), SOURCE, [], 20)
    assert [(box.x, box.y, box.width, box.height) for box in found] == [
        pytest.approx((180, 40, 72, 160), abs=4),
        pytest.approx((40, 60, 60, 120), abs=4),
    ]
    assert finder.update(heat(0, *regions), SOURCE, [], 20) == []


def test_whoever_is_tracked_is_not_found_again_and_what_hangs_together_with_them_is_theirs():
    finder, touching, tracked = (
        MapFinder(default_bank()),
        np.zeros((60, 64), np.uint8),
        [Box(36, 56, 66, 130)],
    )
    assert finder.update(heat(0, (20, 30, body())), SOURCE, tracked, 20) == []
    touching[:, :30] = touching[:, 34:] = body()
    touching[50:, 25:40] = 255
    assert finder.update(heat(1, (20, 30, touching)), SOURCE, tracked, 20) == []
    finder.reset()
    touching[:, 30:34] = 0
    assert len(finder.update(heat(2, (20, 30, touching)), SOURCE, tracked, 20)) == 1


@pytest.mark.parametrize('size', [(60, 30), (100, 8), (6, 12)])
def test_what_lies_or_is_tiny_is_nobody(size):
    finder, region = MapFinder(default_bank()), (20, 30, np.full(size[::-1], 255, np.uint8))
    assert not any(finder.update(heat(n, region), SOURCE, [], 30) for n in range(20))


def test_what_is_less_clear_must_be_seen_in_several_maps():
    finder, square = MapFinder(default_bank()), np.full((60, 34), 255, np.uint8)
    found = [len(finder.update(heat(n, (20 + n, 30, square)), SOURCE, [], 20)) for n in range(8)]
    assert found[0] == 0
    assert sum(found) >= 1
    finder.reset()
    jumping = [(20 + 70 * (n % 2), 30, square) for n in range(8)]
    assert not any(finder.update(heat(n, each), SOURCE, [], 20) for n, each in enumerate(jumping))


@pytest.mark.parametrize('child', [False, True])
def test_a_part_that_the_network_is_sure_of_is_nobody_beside_the_whole(child):
    """Even if it has more of the shape of a body than the whole, as a print on a dress."""
    finder, whole = MapFinder(default_bank()), body((40, 90)).astype(np.uint8) // 4
    if child:
        whole = cv2.dilate(whole, np.ones((7, 7), np.uint8))
        whole[25:70, 10:30] = np.maximum(whole[25:70, 10:30], body((20, 45)))
    else:
        whole[50:, 12:28] = 255
    (found,) = finder.update(heat(0, (20, 10, whole)), SOURCE, [], 20)
    assert (found.y, found.height) == (pytest.approx(20, abs=4), pytest.approx(180, abs=4))


def bar(share: float) -> np.ndarray:
    """Return a mask whose similarity to the whole bar is its share."""
    mask = np.zeros((100, 10), np.uint8)
    mask[: round(100 * share)] = 255
    return mask


@pytest.mark.parametrize(
    ('fits', 'evidence', 'passed'),
    [
        ([0.8, 0.7], 0.0, True),
        ([0.6, 0.6], 1.0, False),
        ([0.6, 0.6], 5.0, True),
        ([0.9, 0.0], 1.0, False),
        ([], 0.0, True),
    ],
)
def test_masks_must_fit_their_templates_the_less_the_more_evidence_there_is(
    fits: list[float], evidence: float, passed: bool
) -> None:
    probation = Probation(10**9)
    for share in fits:
        probation.learn(10**9, bar(share), bar(1.0))
    probation.see(evidence)
    probation.see(0.0)
    assert probation.is_passed(2 * 10**9) == passed


def leg(forward: int) -> np.ndarray:
    """Return a mask, (h, w) uint8, of a leg that stands and one that is so far from it."""
    mask = np.zeros((60, 60), np.uint8)
    mask[:30, 20:40] = mask[30:, 20:25] = mask[30:, 20 + forward : 25 + forward] = 255
    return mask


@pytest.mark.parametrize(
    ('masks', 'later_s', 'passed'),
    [
        ([leg(15)] * 10, 0.1, False),
        ([leg(3 * k) for k in (0, 1, 2, 3, 4, 5, 4, 3, 2, 1)], 0.1, True),
        # Only shapes half a step apart are compared.
        ([leg(15)] * 2, 0.2, True),
        ([leg(15)] * 2, 0.9, True),
        ([leg(0)] * 2 + [leg(0)[::-1].copy()] * 3, 0.1, False),
    ],
)
def test_who_walks_changes_shape_and_stays_a_body(
    masks: list[np.ndarray], later_s: float, passed: bool
) -> None:
    probation = Probation(10**9)
    for number, mask in enumerate(masks):
        probation.learn(10**9 + round(number * later_s * 1e9), mask, mask)
    assert probation.is_passed(2 * 10**9) == passed


def test_masks_tell_after_a_second_and_it_is_over_after_three() -> None:
    probation = Probation(10**9)
    probation.learn(10**9, bar(0.3), bar(1.0))
    assert probation.is_passed(2 * 10**9 - 1)
    assert not probation.is_passed(2 * 10**9)
    assert not probation.is_over(4 * 10**9 - 1)
    assert probation.is_over(4 * 10**9)


def test_who_is_found_in_a_map_has_the_mask_that_it_shows() -> None:
    # A black cabinet goes on from somebody in black who reaches across it.
    image = np.random.default_rng(0).integers(120, 250, (*SOURCE, 3), np.uint8)
    shown = np.zeros(SOURCE, np.uint8)
    shown[60:180, 100:160] = body((60, 120))
    shown[80:90, 130:190] = 255
    image[shown > 0] = 10
    image[95:200, 140:200] = 10
    scene, view = Scene(SOURCE), View(SOURCE, 1.0)
    scene.advance(image, 1, heat=HeatMap(shown, 1))
    scene.add(view)
    box = Box(*cv2.boundingRect(shown))
    start, cue = estimate_first(view, box, None, default_bank(), TrackingConfig(), by_map=True)
    truth = cv2.resize(shown, start.mask.shape[::-1], interpolation=cv2.INTER_AREA) > 127
    mask = start.mask > 0
    assert (mask & truth).sum() > 0.9 * (mask | truth).sum()
    assert cue.weight == 1

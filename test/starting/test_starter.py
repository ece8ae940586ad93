# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import cv2
import numpy as np
import pytest

from gait_segmentation.detector.lookout import Lookout, Sighting
from gait_segmentation.detector.networks import Networks
from gait_segmentation.detector.person_detector import Detection
from gait_segmentation.gait_model import default_bank
from gait_segmentation.geometry import Box
from gait_segmentation.heat_maps import HeatMap
from gait_segmentation.scene.scene import Scene, View
from gait_segmentation.starting import StartingConfig
from gait_segmentation.starting.shapes import BodyShapes
from gait_segmentation.starting.starter import Known, MapFinder, Sightings, Starter
from test.tracking.figures import HEIGHT, WIDTH, Figure, picture
from test.walkers import body, small_bank

BOX, OTHER = Box(10, 10, 40, 100), Box(200, 30, 30, 80)


def seen(seconds, *people):
    return round(seconds * 1e9), tuple(Detection(box, score) for box, score in people)


def test_who_is_seen_for_certain_is_found_at_once_the_tallest_first():
    assert Sightings().update(*seen(1, (OTHER, 0.9), (BOX, 0.7)), [], 20) == [BOX, OTHER]


@pytest.mark.parametrize(
    ('score', 'seconds', 'box', 'found'),
    [
        (0.5, 1.4, BOX, True),
        (0.5, 2.5, BOX, False),
        (0.5, 1.4, BOX.shifted(60, 0), False),
        (0.4, 1.4, BOX.shifted(3, 3), False),
        (0.4, 1.4, BOX.shifted(8, 8), True),
        (0.2, 1.4, BOX.shifted(8, 8), False),
    ],
)
def test_who_is_not_so_certain_must_be_seen_again_or_move(score, seconds, box, found):
    sightings = Sightings()
    assert sightings.update(*seen(1, (BOX, score)), [], 20) == []
    # What does not move is compared with where it was first.
    for _ in range(2):
        assert sightings.update(*seen(1.2, (BOX, min(score, 0.4))), [], 20) == []
    assert sightings.update(*seen(seconds, (box, score)), [], 20) == ([box] if found else [])


def test_nobody_is_found_who_is_tracked_small_or_hardly_like_a_person():
    sightings = Sightings()
    for _ in range(3):
        people = seen(1, (BOX, 0.9), (OTHER, 0.9), (BOX.shifted(300, 0), 0.2))
        assert sightings.update(*people, [BOX.shifted(3, 3)], 90) == []


SOURCE = (240, 320)
SHAPES = BodyShapes(default_bank())


def heat(number, *regions, trust=1.0):
    """Return the map of a frame at half the size of the source, with regions (left, top, what)."""
    values = np.zeros((120, 160), np.uint8)
    for left, top, region in regions:
        values[top : top + region.shape[0], left : left + region.shape[1]] = region
    return HeatMap(values, 1 + number, trust)


def test_people_are_found_at_once_by_the_shape_of_a_body():
    finder = MapFinder(SHAPES)
    regions = (20, 30, body()), (90, 20, body((36, 80), 8))
    assert finder.update(heat(0, *regions, trust=0.0), SOURCE, [], 20) == []
    found = finder.update(heat(0, *regions), SOURCE, [], 20)
    assert [(box.x, box.y, box.width, box.height) for box in found] == [
        pytest.approx((180, 40, 72, 160), abs=4),
        pytest.approx((40, 60, 60, 120), abs=4),
    ]
    assert finder.update(heat(0, *regions), SOURCE, [], 20) == []


def test_whoever_is_tracked_is_not_found_again_and_what_hangs_together_with_them_is_theirs():
    finder, tracked = MapFinder(SHAPES), [Box(36, 56, 66, 130)]
    touching = np.zeros((60, 64), np.uint8)
    assert finder.update(heat(0, (20, 30, body())), SOURCE, tracked, 20) == []
    touching[:, :30] = touching[:, 34:] = body()
    touching[50:, 25:40] = 255
    assert finder.update(heat(1, (20, 30, touching)), SOURCE, tracked, 20) == []
    finder = MapFinder(SHAPES)
    touching[:, 30:34] = 0
    assert len(finder.update(heat(2, (20, 30, touching)), SOURCE, tracked, 20)) == 1


@pytest.mark.parametrize('size', [(60, 30), (100, 8), (6, 12)])
def test_what_lies_or_is_tiny_is_nobody(size):
    finder, region = MapFinder(SHAPES), (20, 30, np.full(size[::-1], 255, np.uint8))
    assert not any(finder.update(heat(n, region), SOURCE, [], 30) for n in range(20))


def test_what_is_less_clear_must_be_seen_in_several_maps():
    finder, square = MapFinder(SHAPES), np.full((60, 46), 255, np.uint8)
    found = [len(finder.update(heat(n, (20 + n, 30, square)), SOURCE, [], 20)) for n in range(8)]
    assert found[0] == 0
    assert sum(found) >= 1
    finder = MapFinder(SHAPES)
    jumping = [(20 + 70 * (n % 2), 30, square) for n in range(8)]
    assert not any(finder.update(heat(n, each), SOURCE, [], 20) for n, each in enumerate(jumping))


@pytest.mark.parametrize('child', [False, True])
def test_a_part_that_the_network_is_sure_of_is_nobody_beside_the_whole(child):
    """Even if it has more of the shape of a body than the whole, as a print on a dress."""
    finder, whole = MapFinder(SHAPES), body((40, 90)).astype(np.uint8) // 4
    if child:
        whole = cv2.dilate(whole, np.ones((7, 7), np.uint8))
        whole[25:70, 10:30] = np.maximum(whole[25:70, 10:30], body((20, 45)))
    else:
        whole[50:, 12:28] = 255
    (found,) = finder.update(heat(0, (20, 10, whole)), SOURCE, [], 20)
    assert (found.y, found.height) == (pytest.approx(20, abs=4), pytest.approx(180, abs=4))


LEAVING = Box(-30, 20, 50, 140)


@pytest.mark.parametrize(
    ('somebody', 'found'),
    [
        (Known(), True),
        (Known(lost=(LEAVING,)), False),
        (Known(tracked=(LEAVING,)), False),
        (Known(lost=(LEAVING.shifted(40, 0),)), True),
        (Known(lost=(LEAVING.shifted(-60, 0),)), True),
        (Known(lost=(Box(-30, 40, 50, 90),)), True),
    ],
)
def test_nobody_begins_with_what_is_left_of_somebody_who_leaves(somebody, found):
    starter = Starter(
        small_bank(), StartingConfig(), 2, Lookout(networks=Networks(lambda image: []))
    )
    scene = Scene((HEIGHT, WIDTH))
    scene.advance(np.zeros((HEIGHT, WIDTH, 3), np.uint8), 1)
    heat = HeatMap(Figure(34, height=80).mask(), 1, 1.0)
    assert bool(starter.propose(scene, heat, None, somebody)) == found


@pytest.mark.parametrize(
    ('seconds', 'pan', 'found'), [(5, 0, False), (29, 0, False), (31, 0, True), (5, 6, True)]
)
def test_a_thing_is_remembered_for_a_time_and_where_it_is(seconds, pan, found):
    starter = Starter(
        small_bank(), StartingConfig(), 2, Lookout(networks=Networks(lambda image: []))
    )
    image = picture([])[0]
    scene = Scene((HEIGHT, WIDTH))
    box, second = Figure(100).box, 1_000_000_000
    scene.advance(image, second)
    scene.add(View((HEIGHT, WIDTH), 1.0))
    starter.reject(box, second)
    for number in range(3):
        scene.advance(np.roll(image, number * pan, axis=1), seconds * second + number)
        starter.propose(scene, None, None, Known())
    sighting = Sighting(scene.stamp_ns, (Detection(box, 0.9),))
    assert bool(starter.propose(scene, None, sighting, Known())) == found


@pytest.mark.parametrize('given', [True, False])
def test_no_walker_is_looked_for_once_boxes_were_given(given, monkeypatch):
    starter = Starter(small_bank(), StartingConfig(auto_init='walk'), 1, Lookout())
    scene, asked = Scene((HEIGHT, WIDTH)), []
    scene.advance(picture([])[0], 1)
    monkeypatch.setattr(
        starter.walkers, 'update', lambda *_, wanted, **__: asked.append(wanted) or []
    )
    starter.propose(scene, None, None, Known(given=given))
    assert asked == [not given]

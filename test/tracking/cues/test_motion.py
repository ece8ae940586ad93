# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from gait_segmentation.scene.scene import Scene, SceneOptions, View
from gait_segmentation.tracking import TrackingConfig
from gait_segmentation.tracking.cues import CueInput
from gait_segmentation.tracking.cues.motion import MotionCue
from gait_segmentation.tracking.pose import Pose
from gait_segmentation.tracking.track import State
from test.tracking.figures import HEIGHT, STEP_NS, WIDTH, wall

RNG = np.random.default_rng(0)
CLOTH = RNG.integers(0, 255, (60, 20, 3)).astype(np.uint8)
WINDOW = slice(0, HEIGHT), slice(0, WIDTH)
TOP = 60


class Walk:
    """A patch of cloth that walks before a wall, and a cue that is told its true mask."""

    def __init__(self, step: int, **tracking) -> None:
        self.config = TrackingConfig(**tracking)
        self.scene, self.view = Scene((HEIGHT, WIDTH)), View((HEIGHT, WIDTH), 1.0)
        self.states: list[State] = []
        self.cue = MotionCue()
        self.step, self.left, self.frames = step, 60, 0

    def see(self, extra: slice | None = None) -> np.ndarray | None:
        """Return the evidence of the next frame; ``extra`` are columns that are noise."""
        image = wall().copy()
        image[TOP : TOP + 60, self.left : self.left + 20] = CLOTH
        if extra is not None:
            shape = image[TOP : TOP + 60, extra].shape
            image[TOP : TOP + 60, extra] = RNG.integers(0, 255, shape)
        self.frames += 1
        still = SceneOptions(camera=False)
        self.scene.advance(image, self.frames * STEP_NS, options=still)
        if not self.scene.views:
            self.scene.add(self.view)
        self.states.append(State(self.view.now, (float(self.left), 0.0)))
        nothing = np.zeros((HEIGHT, WIDTH), np.float32)
        pose = Pose(self.left + 10.0, TOP + 30.0, 100.0, 10, 10)
        given = CueInput(
            self.view, self.states, pose, WINDOW, self.mask, nothing, True, 0.1, self.config
        )
        found = self.cue.evidence(given)
        self.values = None if found is None else found.values
        return None if found is None else found.logit

    def learn(self, mask: np.ndarray) -> None:
        """Tell the mask of the frame, and let the cloth go on."""
        self.view.add_background(self.view.now, mask, [])
        if self.values is not None:
            self.cue.calibrate(self.values, mask)
        self.left += self.step

    @property
    def mask(self) -> np.ndarray:
        mask = np.zeros((HEIGHT, WIDTH), np.uint8)
        mask[TOP : TOP + 60, self.left : self.left + 20] = 255
        return mask


def test_what_moves_with_the_body_is_the_persons_before_anything_is_learnt() -> None:
    walk = Walk(3)
    for _ in range(4):
        walk.see()
        walk.left += walk.step
    evidence, on = walk.see(), walk.mask > 0
    assert evidence[on].mean() > 0.3
    assert evidence[~on].mean() < 0.1


@pytest.mark.parametrize(('step', 'told'), [(1, True), (0, False)])
def test_of_who_stands_nothing_is_told_until_it_is_learnt(step: int, told: bool) -> None:
    walk = Walk(step)
    for _ in range(5):
        evidence = walk.see()
        walk.left += walk.step
    assert bool(evidence.any()) == told


def test_only_what_changes_for_longer_than_a_step_of_the_light_moves() -> None:
    """Which is seen in as many frames as are between the two that are compared."""
    seen: list[list[float]] = [[], []]
    for walk, found in zip((Walk(4), Walk(0)), seen, strict=True):
        for number in range(16):
            # Elsewhere something changes in each frame: of one that is repeated nothing is known.
            walk.see(slice(200, 220))
            found.append(walk.cue.lasting)
            walk.left += 8 if number == 7 else walk.step
            assert walk.cue.moving is None or number != 8 or walk.cue.moving > 0.2
    assert min(seen[0][6:]) > 0.2
    assert max(seen[1]) == 0


def test_an_arm_that_swings_is_learnt_to_be_the_persons() -> None:
    walk, arm = Walk(0), slice(80, 90)
    for _ in range(12):
        evidence = walk.see(arm)
        mask = walk.mask
        mask[TOP : TOP + 60, arm] = 255
        walk.learn(mask)
    assert np.median(evidence[TOP : TOP + 60, 82:88]) > 0.3
    assert np.median(evidence[:TOP]) < 0


def test_what_the_person_has_left_is_learnt_to_be_the_walls() -> None:
    walk = Walk(4)
    for _ in range(14):
        evidence = walk.see()
        left = walk.left
        walk.learn(walk.mask)
    # Uncovered since the frame that is compared: it changed, and is hardly anybody.
    assert np.median(evidence[TOP + 5 : TOP + 55, left - 12 : left - 4]) < 0.15
    assert np.median(evidence[TOP + 5 : TOP + 55, left + 4 : left + 16]) > 0.5


def test_it_can_be_switched_off_and_weighed() -> None:
    found = []
    for weight in (0.2, 0.4):
        walk = Walk(3, motion_weight=weight)
        for _ in range(6):
            evidence = walk.see()
            walk.learn(walk.mask)
        found.append(evidence)
    np.testing.assert_allclose(2 * found[0], found[1], rtol=1e-5)
    walk = Walk(3, use_motion_cue=False)
    assert all(walk.see() is None for _ in range(6))

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether what a track holds is a thing: it has ceased to move, and looks otherwise since."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.scene.scene import MOST_KEPT
from gait_segmentation.tracking.appearance import similarity

_STILL_NS = 300_000_000
"""Time without motion after which it is asked what is there: people sway, things do not."""

_MOVES = 0.01
"""Least share of a person's pixels that move, seen over some frames, though they stand."""

_PROOF_NS = 1_000_000_000
"""Time without motion after which it is a thing, if it has to move because nobody gave its box."""

_CERTAIN = 0.8
"""Score of a detector, in a later look, from which it need not move: hardly a thing has it."""

_UNLIKE = 0.9
"""Similarity of the colours below which they are not those of who moved: people change little."""


class Stillness:
    """
    When a person was seen to move last, and what they looked like before that.

    Whoever leaves uncovers what is behind them, which moves no more, and looks otherwise: a track
    that goes on with it has learnt its colours, and is as sure of it as of the person.  Somebody
    who stands quite still looks as before.  But what looks a little like a person to a network, as
    a coat on a hook does, must be seen to move once.
    """

    def __init__(self, found_ns: int | None = None) -> None:
        """
        Begin without having seen motion.

        :param found_ns: stamp of the frame it was found in by its looks, None if it need not move.
        """
        self._found_ns = found_ns
        self.is_thing = False
        """Whether it has had to move for long, and did not."""

        self.is_doubted = False
        """Whether what is there neither moves nor looks like the person who did."""

        self._moved_ns: int | None = None
        # What covers somebody, as a door does, becomes theirs frame by frame: what counts is what
        # they looked like before that.
        self._looks: deque[NDArray[np.float32]] = deque(maxlen=MOST_KEPT)

    def is_asked(self, stamp_ns: int, moving: float | None) -> bool:
        """
        Take in a frame, and return whether it is to be seen what is there.

        :param moving: share of what is expected to be the person that moves against the world,
            None if that is not known.
        """
        if moving is None:
            return False
        if moving >= _MOVES:
            self._moved_ns, self._found_ns, self.is_doubted = stamp_ns, None, False
        self.is_thing = self._found_ns is not None and stamp_ns - self._found_ns >= _PROOF_NS
        return self._moved_ns is not None and stamp_ns - self._moved_ns >= _STILL_NS

    def vouch(self, score: float) -> None:
        """Take in how sure (0..1) a detector is of it in a look after it was found."""
        if score >= _CERTAIN:
            self._found_ns = None

    def remember(self, looks: NDArray[np.float32], stamp_ns: int) -> None:
        """Take in what a person looks like, see ``colour_signature``, in a frame they move in."""
        if stamp_ns == self._moved_ns:
            self._looks.append(looks)

    def judge(self, looks: NDArray[np.float32]) -> None:
        """Take in what is there that does not move, see ``colour_signature``."""
        if similarity(self._looks[0], looks) < _UNLIKE:
            self.is_doubted = True

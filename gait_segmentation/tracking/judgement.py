# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What all cues together say of the pixels about a person."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gait_segmentation.colour import colour_bins
from gait_segmentation.images import Window, distance_from
from gait_segmentation.tracking.competition import beyond
from gait_segmentation.tracking.config import TrackingConfig
from gait_segmentation.tracking.cues.cue import View
from gait_segmentation.tracking.likelihood.log_ratio import log_ratio
from gait_segmentation.tracking.person.person import Person
from gait_segmentation.tracking.world import World

__all__ = ['judge']


def judge(
    person: Person,
    world: World,
    expected: NDArray[np.uint8],
    config: TrackingConfig,
    *,
    seen: bool,
) -> tuple[Window, NDArray[np.float32], NDArray[np.float32]] | None:
    """
    Judge the pixels of the newest frame in a window about a person.

    :param expected: (h, w) uint8 0/255 of that window, where the person is expected.
    :param seen: whether the person was seen until now: else nothing is known of the motion.
    :returns: the window, its log-likelihood ratios, (h, w) float32, and how far its pixels are
        beside the person expected, likewise; None if all of the window is outside of the image.
    """
    record = world.now
    window = person.window(world.shape)
    if window[0].start >= window[0].stop or window[1].start >= window[1].stop:
        return None
    lab = record.image.lab_part(window)
    bins, rows = colour_bins(lab), person.rows(window)
    away = distance_from(expected > 127)
    strangers = None
    if seen and person.template is not None:
        strangers = np.float32(config.stranger_density) * beyond(away, person.height)
    logit = log_ratio(
        lab,
        bins,
        rows,
        window,
        record.background,
        person.person,
        person.surroundings,
        config,
        strangers,
    )
    center = (person.center_x, person.center_y)
    for cue in person.cues:
        view = View(world, person.track_id, center, person.height, window, logit, seen, config)
        evidence = cue.evidence(view)
        if evidence is not None:
            logit += evidence
    return window, logit, away

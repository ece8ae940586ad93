# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from gait_segmentation.detector.sources import Sources
from gait_segmentation.starting import StartingConfig
from test.tracking.figures import blind
from test.walkers import clip, small_bank


def test_the_maps_of_another_film_are_trusted_or_not_by_themselves():
    sources = Sources(small_bank(), StartingConfig(), blind())
    for waiting in (True, False):
        trust = []
        for frame, inverted in zip(clip()[:2], (255, 0), strict=True):
            sources.add_heat_map(frame.masks[0] ^ inverted, frame.stamp_ns)
            seen = sources.look(
                frame.image, frame.stamp_ns, boxes=True, bodies=([], []), urgent=False,
                small=lambda height: False, heat_map_age=0.0, since_ns=0,
            )  # fmt: skip
            trust.append(seen.heat.trust)
            sources.reset(waiting=waiting)
        assert trust == [0, 1]

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from gait_segmentation.ros.topics import slot_topic, slot_topics


def test_topics_of_all_slots() -> None:
    assert slot_topic(3, 'box') == 'person_3/box'
    assert slot_topics({'box': int, 'mask': str}, 2) == {
        'person_0/box': int,
        'person_0/mask': str,
        'person_1/box': int,
        'person_1/mask': str,
    }

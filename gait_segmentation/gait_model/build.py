# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How a walker is built, dressed and walks; the named builds of the standard bank."""

from __future__ import annotations

from dataclasses import dataclass

from gait_segmentation.config import StageConfig, parameter
from gait_segmentation.errors import BankError

__all__ = ['BUILDS', 'FIGURES', 'Build', 'named_build']


@dataclass(frozen=True)
class Build(StageConfig):
    """
    Body, clothes and way of walking of one person; lengths are in statures.

    :raises ConfigError: if a value is outside what its field allows.
    """

    girth: float = parameter(
        1.0, 'Factor on the thickness of trunk and limbs.', minimum=0.6, maximum=1.6
    )
    trunk_cloth: float = parameter(
        0.012, 'Thickness of the clothes on the trunk.', unit='stature', minimum=0.0, maximum=0.05
    )
    sleeve_cloth: float = parameter(
        0.010, 'Thickness of the sleeves.', unit='stature', minimum=0.0, maximum=0.04
    )
    leg_cloth: float = parameter(
        0.012,
        'Thickness of the trousers; large values hang loose below the knee.',
        unit='stature',
        minimum=0.0,
        maximum=0.04,
    )
    hem: float = parameter(
        0.0,
        'Length of a skirt, dress or coat below the hip joint; 0 = none, 0.25 = to the knee.',
        unit='stature',
        minimum=0.0,
        maximum=0.48,
    )
    flare: float = parameter(
        0.015,
        'How far the hem stands off the leg.',
        unit='stature',
        minimum=0.0,
        maximum=0.1,
    )
    rucksack: float = parameter(
        0.0, 'Depth of a rucksack; 0 = none.', unit='stature', minimum=0.0, maximum=0.25
    )
    hair: float = parameter(
        0.009, 'Thickness of the hair.', unit='stature', minimum=0.0, maximum=0.04
    )
    bun: float = parameter(
        0.0,
        'Radius of hair tied at the back of the head; 0 = none.',
        unit='stature',
        minimum=0.0,
        maximum=0.05,
    )
    arm_swing: float = parameter(
        1.1, "Factor on the arms' swing about their mean.", minimum=0.0, maximum=2.0
    )
    arm_balance: float = parameter(
        0.0,
        'Share of the swing that goes from the right arm to the left one: 0 both alike, 1 the '
        'right arm is held still, as when it carries something, -1 the left one.',
        minimum=-1.0,
        maximum=1.0,
    )
    speed: float = parameter(
        -0.3,
        'Walking speed on the scale of the norm data: -2 very slow, 0 free, 2 very fast.',
        minimum=-2.0,
        maximum=2.0,
    )
    lean: float = parameter(
        0.0, 'Lean of the trunk beyond the usual, forward.', unit='rad', minimum=-0.3, maximum=0.5
    )
    twist: float = parameter(
        1.0,
        'Factor on the turning of the hips, and of the shoulders against them.',
        minimum=0.0,
        maximum=2.0,
    )
    head: float = parameter(
        0.0,
        'How much farther forward than usual the head is carried.',
        unit='stature',
        minimum=-0.03,
        maximum=0.05,
    )
    shoe: float = parameter(
        1.0, 'Factor on the size of the feet and shoes.', minimum=0.7, maximum=1.5
    )


BUILDS: dict[str, Build] = {
    'average': Build(),
    # One arm swings more than the other in nearly everybody; here the left one is held still, in
    # the two below the right one.
    'uneven': Build(
        trunk_cloth=0.010,
        sleeve_cloth=0.004,
        leg_cloth=0.010,
        hair=0.013,
        arm_swing=1.05,
        arm_balance=-0.35,
        speed=-0.45,
        twist=0.0,
        head=0.004,
        shoe=1.08,
    ),
    'rucksack': Build(
        rucksack=0.12,
        trunk_cloth=0.024,
        arm_swing=1.4,
        arm_balance=0.2,
        speed=0.1,
        lean=0.08,
    ),
    'dress': Build(
        hem=0.32,
        flare=0.04,
        leg_cloth=0.0,
        sleeve_cloth=0.002,
        trunk_cloth=0.014,
        rucksack=0.075,
        bun=0.032,
        arm_swing=0.85,
        arm_balance=0.4,
        lean=-0.05,
    ),
    'coat': Build(hem=0.20, flare=0.02, trunk_cloth=0.022, sleeve_cloth=0.015),
    'stout': Build(girth=1.15),
    'slim': Build(girth=0.9, trunk_cloth=0.004, sleeve_cloth=0.004, leg_cloth=0.004),
}

FIGURES = ('average', 'rucksack', 'dress', 'coat', 'stout', 'slim')
"""Builds that made-up walkers have; another one here would change every clip drawn so far."""


def named_build(build: str | Build) -> Build:
    """
    Return a build by name; a build is passed through.

    :raises BankError: for an unknown name.
    """
    if isinstance(build, Build):
        return build
    if build not in BUILDS:
        raise BankError(f'build must be one of {", ".join(BUILDS)}, got {build!r}')
    return BUILDS[build]

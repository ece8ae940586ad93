# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Parameters of the tracking stage."""

from __future__ import annotations

from dataclasses import dataclass

from gait_segmentation.config import StageConfig, parameter
from gait_segmentation.scene.scene import SceneOptions


@dataclass(frozen=True)
class TrackingConfig(StageConfig):
    """Parameters of the tracking stage; lengths are in body heights unless a unit is given."""

    method: str = parameter(
        'fusion',
        'How people are followed: fusion (optical flow; a likelihood of colours, background and '
        'motion that learns from the masks), adaptive_mean_shift (as in the paper: the likelihood '
        'of chosen features moves and scales the box, and nothing else of this stage is used). '
        'Tracks that have begun stay as they are.',
        choices=('fusion', 'adaptive_mean_shift'),
    )
    working_size: int = parameter(
        640,
        'Longest side of the working image; larger sources are scaled down. 0 = no limit.',
        unit='px',
        minimum=0,
        maximum=4096,
        fixed=True,
    )
    working_height: int = parameter(
        128,
        'Height of the person in the working image; taller people are scaled down to it. '
        'More costs time and sharpens the likelihood only for large people.',
        unit='px',
        minimum=40,
        maximum=1000,
        fixed=True,
    )
    box_margin: float = parameter(
        0.03,
        'Share of the given first box that is surroundings, on each side.',
        minimum=0.0,
        maximum=0.2,
    )
    heat_map_age: float = parameter(
        0.2,
        'Age up to which the newest heat map counts where a frame has none of its own; it is '
        'moved along with people.',
        unit='s',
        minimum=0.0,
        maximum=2.0,
    )
    colour_rate: float = parameter(
        0.15,
        'Share by which the colour histograms of the surroundings move towards the newest frame.',
        minimum=0.0,
        maximum=1.0,
    )
    person_colour_rate: float = parameter(
        0.05,
        'The same of the person, who keeps the clothes while the surroundings pass.',
        minimum=0.0,
        maximum=1.0,
    )
    band_share: float = parameter(
        0.7,
        "Weight of the colours of a pixel's own height band against those of the whole body.",
        minimum=0.0,
        maximum=1.0,
    )
    colour_floor: float = parameter(
        1e-4,
        'Probability of a colour never seen; keeps unknown colours neutral.',
        minimum=1e-7,
        maximum=0.1,
    )
    foreground_density: float = parameter(
        1e-3,
        'Probability of each colour of other foreground, away from where the person is expected. '
        'Higher keeps the mask to the person when others pass.',
        minimum=0.0,
        maximum=0.1,
    )
    use_association: bool = parameter(True, 'Associate each pixel with one person.', fixed=True)
    use_bystanders: bool = parameter(
        True,
        'Follow those beside who are tracked, too, so that each takes their own pixels along.',
    )
    use_light: bool = parameter(True, 'Undo what light does to the levels.', fixed=True)
    use_flicker: bool = parameter(True, 'Undo the bands of lamps that flicker, too.', fixed=True)
    use_fade: bool = parameter(True, 'Keep what is known when the colours go.', fixed=True)
    use_contrast: bool = parameter(True, 'Spread the levels where few are used.', fixed=True)
    use_background: bool = parameter(
        True, 'Learn the background pixel by pixel and use it in the likelihood ratio.'
    )
    background_trust: float = parameter(
        0.95,
        'Largest weight of the background model against the background colours.',
        minimum=0.0,
        maximum=0.999,
    )
    use_shadow: bool = parameter(
        True,
        'Explain darker pixels of unchanged chroma near the feet as cast shadow.',
    )
    shadow_share: float = parameter(
        0.25,
        'Prior share of shadow among the background pixels at the feet.',
        minimum=0.0,
        maximum=0.5,
    )
    shadow_floor: float = parameter(
        0.5,
        'Darkest shadow, as a share of the lightness of the background.',
        minimum=0.05,
        maximum=0.95,
    )
    use_relight: bool = parameter(
        True, 'Take what shows the texture of the background, brighter or darker, for it.'
    )
    use_sightings: bool = parameter(
        True, 'Take nothing beyond the box in which the detector sees a person for theirs.'
    )
    use_ego_motion: bool = parameter(
        True, 'Estimate the motion of the camera and move the background model with it.'
    )
    use_texture: bool = parameter(
        True, 'In images without colour, use the energy of the gradients in place of colour.'
    )
    use_motion_gate: bool = parameter(
        True, 'Do not learn as background what moves against it: other people, cars.'
    )
    use_motion_cue: bool = parameter(
        True, 'Prefer as person what moves with the body, as background what stays.'
    )
    motion_weight: float = parameter(
        0.3, 'Weight of the cue from motion.', minimum=0.0, maximum=2.0
    )
    use_tilt: bool = parameter(
        True, 'Follow the tilt of the body, as wide-angle cameras show it near their borders.'
    )
    use_stillness: bool = parameter(
        True, 'Take for gone who neither moves nor looks as when they moved last.'
    )
    patience: float = parameter(
        3.0,
        'How long a lost person (occluded or gone) is searched for before the track ends.',
        unit='s',
        minimum=0.0,
        maximum=60.0,
    )

    @property
    def scene_options(self) -> SceneOptions:
        """Return what is to be measured of the scene."""
        return SceneOptions(
            camera=self.use_ego_motion,
            texture=self.use_texture,
            light=self.use_light,
            flicker=self.use_flicker,
            fade=self.use_fade,
            contrast=self.use_contrast,
        )

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
# %% [markdown]
"""
How people in a film walk: silhouettes, gait phase and walking direction, drawn as gait.png.

It needs `pip install . matplotlib`.  Run it as `python examples/plot_gait.py walk.mp4`, or cell by
cell: VS Code, and Jupyter with jupytext, open it as a notebook.
"""

# %%
import sys
from collections import defaultdict
from pathlib import Path

import cv2
import matplotlib.pyplot as plt
import numpy as np

from gait_segmentation.inputs import open_input
from gait_segmentation.pipeline import Pipeline

# %% A film of your own, or the walker beside this file, who has 20 frames a second.
walker = Path(globals().get('__file__', '')).parent / 'walker/frames'
given = [] if 'ipykernel' in sys.modules else sys.argv[1:]
film = open_input(given[0]) if given else open_input(walker, rate=20)


# %% Run all frames, and keep what is drawn.
def portrait(image, person):
    """Return the image about a person, RGB, with their silhouette in the colour of the track."""
    colour = 255 * np.array(plt.cm.tab10(person.track.track_id % 10)[2::-1])
    mask, box = person.segmentation.mask[..., None] > 0, person.track.box
    tinted = np.where(mask, 0.5 * image + 0.5 * colour, image).astype(np.uint8)
    size, centre = (0.8 * box.height, 1.2 * box.height), (box.center_x, box.center_y)
    return cv2.getRectSubPix(tinted, [round(side) for side in size], centre)[..., ::-1]


walks = defaultdict(list)  # by track id: time in s, phase, strides per s, direction in radians
portraits = []
pipeline = Pipeline()
for frame in film.frames():
    if frame.image is None:  # cannot be read
        continue
    for result in pipeline.update(frame.image, frame.stamp_ns):
        for person in result.people:
            track, match, time_s = person.track, person.match, result.stamp_ns / 1e9
            if track.box is not None and match.body is not None:
                walk = walks[track.track_id]
                walk.append((time_s, match.phase, match.phase_rate, match.azimuth))
                if len(walk) % 5 == 1:  # more would only take memory
                    portraits.append((time_s, portrait(frame.image, person)))

# %% Draw it, directions from -135 to 225 degrees: few walk where the axis is cut.
assert walks, 'nobody was seen walking'
figure, axes = plt.subplot_mosaic('012345;pppppp;dddddd', figsize=(10, 7), layout='constrained')
for place, index in enumerate(np.linspace(0, len(portraits) - 1, 6).round().astype(int)):
    axes[str(place)].axis('off')
    axes[str(place)].imshow(portraits[index][1])
    axes[str(place)].set_title(f'{portraits[index][0]:.1f} s')
for track_id, walk in walks.items():
    times, phases, rates, azimuths = np.transpose(walk)
    look = {'color': plt.cm.tab10(track_id % 10), 'label': f'{np.median(rates):.2f} strides/s'}
    axes['p'].plot(times, phases, 'o', markersize=4, **look)
    axes['d'].plot(times, (np.degrees(azimuths) + 135) % 360 - 135, 'o', markersize=4, **look)
axes['p'].set(title='Gait phase', ylabel='strides since heel contact', ylim=(0, 1))
axes['p'].legend(loc='lower right', bbox_to_anchor=(1, 1), ncol=5, frameon=False)
axes['d'].set(title='Walking direction', xlabel='time (s)', ylim=(-135, 225))
axes['d'].set_yticks([-90, 0, 90, 180], ['closer, -90°', 'right, 0°', 'away, 90°', 'left, 180°'])
axes['p'].grid(alpha=0.4)
axes['d'].grid(alpha=0.4)
figure.savefig('gait.png')
print('gait.png shows silhouettes, phase and direction')

# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
What each mechanism is worth: it is left out by its switch, alone, over many films.

Films are run from their boxes and from moved ones.  Scores are means over the frames that show
the person, then over boxes, the films of a place, and places.  A difference counts if its
interval, of a bootstrap over places, leaves out zero, over all films or over those of a group.
"""

from __future__ import annotations

import itertools
import json
import math
import re
import statistics
from collections.abc import Iterable, Iterator, Sequence as ListLike
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np

from gait_segmentation.config import overridden
from gait_segmentation.errors import SequenceError
from gait_segmentation.geometry import Box
from gait_tools.evaluation.sequence import Sequence
from gait_tools.evaluation.session import Session
from gait_tools.evaluation.variants import Left, Variant
from gait_tools.outputs import keep_others, write_json

Scores = dict[str, dict[str, float]]  # by ``NAME@BOX``, of one film run from one box

SCORES = ('J', 'F', 'box')
"""Scores of masks, of their outlines, and IoU of the refined boxes, as docs/evaluation.md says."""
GROUPS: dict[str, dict[str, str]] = {
    'all': {},
    'walkers': {'kind': 'walk'},
    'static': {'camera': 'static'},
    'moving': {'camera': 'moving'},
    'walkers static': {'kind': 'walk', 'camera': 'static'},
    'walkers moving': {'kind': 'walk', 'camera': 'moving'},
    'others': {'kind': 'other'},
}
"""Which films are looked at together, by what ``sequence.yaml`` says of them."""

_HEAD = re.compile(rb'\{\s*"settings": \[')


class Mechanism(NamedTuple):
    """What can be left out; ``off`` are the settings that do so, ``films`` where that is run."""

    name: str
    off: str
    films: tuple[str, ...] = ('plain',)


WHOLE = Mechanism('nothing', '', ('plain', 'ramp', 'flicker', 'night', 'grey', 'low', 'left'))
SPOILT = WHOLE.films[1:]
MECHANISMS = (
    WHOLE,
    Mechanism('light', 'tracking.use_light=false', ('plain', 'ramp')),
    Mechanism('flicker', 'tracking.use_flicker=false', ('plain', 'flicker')),
    Mechanism('grey fade', 'tracking.use_fade=false', ('plain', 'night')),
    Mechanism('contrast', 'tracking.use_contrast=false', ('plain', 'low')),
    Mechanism('texture', 'tracking.use_texture=false', ('plain', 'grey')),
    Mechanism('ego-motion', 'tracking.use_ego_motion=false'),
    Mechanism('box margin', 'tracking.box_margin=0'),
    Mechanism('background model', 'tracking.use_background=false'),
    Mechanism('motion gate', 'tracking.use_motion_gate=false'),
    Mechanism('shadow', 'tracking.use_shadow=false'),
    Mechanism('relight', 'tracking.use_relight=false'),
    Mechanism('motion cue', 'tracking.use_motion_cue=false'),
    Mechanism('colour bands', 'tracking.band_share=0'),
    Mechanism('colours of the place', 'tracking.colour_rate=0'),
    Mechanism('colours of the person', 'tracking.person_colour_rate=0'),
    Mechanism('other foreground', 'tracking.foreground_density=0'),
    Mechanism('pixel association', 'tracking.use_association=false'),
    Mechanism('tilt', 'tracking.use_tilt=false'),
    Mechanism('sightings', 'tracking.use_sightings=false'),
    Mechanism('bystanders', 'tracking.use_bystanders=false'),
    Mechanism('stillness', 'tracking.use_stillness=false', ('plain', 'left')),
    Mechanism('search for the lost', 'tracking.patience=0'),
    Mechanism('likelihood blur', 'matching.blur=1'),
    Mechanism('phase clock', 'matching.rate_cost=0'),
    Mechanism('path memory', 'matching.memory=0.05'),
    Mechanism('path switching margin', 'matching.switch_margin=0'),
    Mechanism('placement search', 'matching.shifts_x=0 matching.shifts_y=0'),
    Mechanism('scale search', 'matching.scales=0'),
    Mechanism('shape prior', 'segmentation.prior=none'),
    Mechanism("default (for paper's) prior", 'segmentation.prior=paper'),
    Mechanism('prior in the data term', 'segmentation.template_weight=0'),
    Mechanism("prior's fading", 'segmentation.fit_high=0.65'),
    Mechanism('contrast term', 'segmentation.contrast=0'),
    Mechanism('support', 'segmentation.use_support=false'),
    Mechanism('refinement', 'segmentation.use_refinement=false'),
)
"""In the order in which a frame meets them."""


def scores_of(session: Session, config: Any, run: tuple[Sequence, int]) -> dict[str, float]:
    """Return the scores of a film, run from its box (0) or from one that the seed moves."""
    cv2.setNumThreads(1)
    sequence, number = run
    rng = np.random.default_rng(1000 + number)
    starts = sequence.starts
    if number > 0:
        starts = {n: tuple(_moved(box, rng, *sequence.size) for box in starts[n]) for n in starts}
    summary = session.score(config, sequence, starts)
    if isinstance(sequence, Left):
        return dict.fromkeys(SCORES, statistics.fmean(e.j for e in sequence.gone(summary.scores)))
    shown = [each for each in summary.scores if not math.isnan(each.visible.iou)]
    j = statistics.fmean(each.j for each in shown)
    if sequence.label_files:
        j = float(summary.tracking.numbers()['J'] or 0.0)
    f = statistics.fmean(each.f for each in shown)
    return {'J': j, 'F': f, 'box': statistics.fmean(each.matched.iou for each in shown)}


def _moved(box: Box, rng: np.random.Generator, width: int, height: int) -> Box:
    """Return a box off by up to 4 % of its height, to a tenth of a pixel."""
    dx, dy, wider, taller = rng.uniform(-0.04, 0.04, 4) * box.height
    moved = Box(box.x + dx, box.y + dy, box.width + wider, box.height + taller)
    moved = moved.clipped(width, height) or box
    return Box(*(round(each, 1) for each in (moved.x, moved.y, moved.width, moved.height)))


def ablate(
    session: Session,
    config: Any,
    settings: ListLike[str],
    out: Path,
    boxes: int = 1,
    jobs: int = 1,
    spoilt: Iterable[str] = (),
) -> Iterator[str]:
    """Run all films without each mechanism; yield the lines of a Markdown table as they come."""
    titles = 'left out', 'films', *SCORES, 'worse without', 'better without'
    yield f'| {" | ".join(titles)} |\n{"|---" * len(titles)}|\n'
    whole: dict[str, Scores] = {}
    rows = [(each, film) for each in MECHANISMS for film in each.films]
    with ProcessPoolExecutor(jobs, get_context('spawn')) as pool:
        for mechanism, film in (row for row in rows if row[1] in ('plain', *spoilt)):
            off, path = mechanism.off.split(), out / f'{mechanism.name}@{film}.json'
            about = [*settings, *off]
            known = _read(path, about)
            runs = {
                f'{each.name}@{number}': (each, number)
                for each, number in itertools.product(
                    _spoilt(session.sequences, film), range(boxes)
                )
            }
            new = [name for name in runs if name not in known]
            once = partial(scores_of, replace(session, sequences=()), overridden(config, off))
            found = (map if jobs == 1 else pool.map)(once, (runs[name] for name in new))
            try:
                known.update(zip(new, found, strict=True))
            finally:
                # Of a run that is stopped, what there is.
                write_json(path, {'settings': about, 'scores': known})
            scores = {name: known[name] for name in runs}
            yield _row(mechanism, film, scores, whole.setdefault(film, scores), session.sequences)


def _spoilt(sequences: Iterable[Sequence], film: str) -> list[Sequence]:
    """Return films of a kind; those that cannot be made so are left out."""
    if film != 'left':
        return [Variant.of(each, film) for each in sequences]
    return [left for each in sequences if (left := Left.of(each)) is not None]


def _row(
    mechanism: Mechanism,
    film: str,
    scores: Scores,
    whole: Scores,
    sequences: Iterable[Sequence],
) -> str:
    """Return a line of the table."""
    about = {each.name: {'place': each.name, **each.about} for each in sequences}
    cells = [mechanism.name, film]
    worse: dict[str, list[str]] = {}
    better: dict[str, list[str]] = {}
    for score, (group, wanted) in itertools.product(SCORES, GROUPS.items()):
        by_place: dict[str, list[tuple[float, float]]] = {}
        for name, found in scores.items():
            of = about[name.rpartition('@')[0]]
            if wanted.items() <= of.items():
                pair = found[score], found[score] - whole[name][score]
                by_place.setdefault(str(of['place']), []).append(pair)
        if not by_place:
            continue
        means = np.array([np.mean(each, axis=0) for each in by_place.values()])
        changes = means[:, 1]
        draws = np.random.default_rng(0).choice(changes, (10000, len(changes))).mean(axis=1)
        low, high = np.percentile(draws, (2.5, 97.5))
        if group == 'all':
            change = f'{changes.mean():+.4f}' if changes.any() else '0'
            if score == 'J' and changes.any():
                change += f' ({low:+.4f}..{high:+.4f})'
            cells.append(f'{means[:, 0].mean():.3f}' if mechanism is WHOLE else change)
        verdict = worse if high < 0 else better
        # Of what is so for all films the groups need not be told.
        if (low > 0 or high < 0) and verdict.get(score) != ['all']:
            verdict.setdefault(score, []).append(group)
    for verdict in (worse, better):
        cells.append('; '.join(f'{score}: {", ".join(in_)}' for score, in_ in verdict.items()))
    return f'| {" | ".join(cells)} |\n'


def _read(path: Path, settings: list[str]) -> Scores:
    """Return what an earlier run with the same settings found."""
    keep_others([('--out', path, lambda head: _HEAD.match(head) is not None)], 'gait_evaluate')
    try:
        known = json.loads(path.read_text()) if path.exists() else {}
    except (OSError, ValueError) as error:
        raise SequenceError(f'{path} cannot be read: {error}') from error
    return dict(known.get('scores', {})) if known.get('settings') == settings else {}

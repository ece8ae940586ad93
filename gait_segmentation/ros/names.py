# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Names of parameters, and which of them are slips of the pen: for the nodes and for gait_replay.

Nothing here needs ROS.
"""

from __future__ import annotations

import difflib
from collections.abc import Collection, Iterable

__all__ = ['misnamed', 'qualified']

_ALIKE = 0.75
"""How alike names must be, from 0 to 1, for one to be taken for the other."""


def qualified(group: str, name: str) -> str:
    """Return the ROS name of a parameter: those of a stage have its name in front."""
    return f'{group}.{name}' if group else name


def misnamed(given: Iterable[str], known: Collection[str]) -> dict[str, str]:
    """
    Return which parameters given to a node are probably meant to be others that it has.

    Those of other nodes are no mistake, as one file may serve all: only what claims to be of a
    stage of the node, or what nearly has the name of a parameter or of a stage.

    :param given: names.
    :param known: names of the parameters the node has.
    :returns: from each such name to the most similar one, empty if none is.
    """
    stages: dict[str, list[str]] = {}
    for name in known:
        stage, _, own = name.rpartition('.')
        stages.setdefault(stage, []).append(own)
    found = {}
    for name in given:
        stage, _, own = name.rpartition('.')
        meant = stage if stage in stages else _most_alike(stage, stages)
        alike = _most_alike(own, stages.get(meant, ())) if meant or not stage else ''
        if name not in known and (alike or (stage and stage in stages)):
            found[name] = qualified(meant, alike) if alike else ''
    return found


def _most_alike(name: str, names: Iterable[str]) -> str:
    return next(iter(difflib.get_close_matches(name, names, n=1, cutoff=_ALIKE)), '')

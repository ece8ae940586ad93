# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One evaluation: several sequences, one configuration, one report."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence as ListLike
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gait_segmentation.config import replaced
from gait_segmentation.errors import SequenceError
from gait_segmentation.evaluation.output import SequenceOutput
from gait_segmentation.evaluation.report import Summary, mean_of, restart_report
from gait_segmentation.evaluation.restarts import StartScore, restarts_of, run_restarts
from gait_segmentation.evaluation.runner import (
    Runnable,
    check_truth,
    heat_maps_of,
    likelihoods_of,
    run_sequence,
)
from gait_segmentation.evaluation.sequence import Sequence
from gait_segmentation.evaluation.tracking_score import TrackingScore, first_frames

__all__ = ['Progress', 'Session', 'load_sequences']

Progress = Callable[[Iterable[Any], str, int], Iterator[Any]]
"""Passes on so many items of a name, and may show how far it is."""


def load_sequences(
    folders: Iterable[Path], likelihood: str = '', heat_map: str = ''
) -> list[Sequence]:
    """
    Open sequences to be scored.

    :param likelihood: folder of likelihood images that each must have, if it is not empty.
    :param heat_map: the same of heat maps.
    :raises SequenceError: if one cannot be used, has no ground truth, or two have one name.
    """
    loaded: dict[str, Sequence] = {}
    for folder in folders:
        sequence = Sequence.load(folder)
        check_truth(sequence)
        likelihoods_of(sequence, likelihood)
        heat_maps_of(sequence, heat_map)
        if sequence.name in loaded:
            raise SequenceError(
                f'{sequence.folder} has the same name as {loaded[sequence.name].folder}; '
                'every sequence needs a name of its own'
            )
        loaded[sequence.name] = sequence
    return list(loaded.values())


@dataclass(frozen=True)
class Session:
    """
    What stays the same while configurations are compared.

    ``make_pipeline`` makes a pipeline that has seen nothing from a configuration, ``clock`` gives
    seconds.  With ``restarts`` the report has the restart score, too, and with ``warm`` that of
    pipelines that have seen the clip from its first frame on.  ``likelihood`` is the folder
    beside the frames with likelihood images to use, empty for the tracker's, and ``heat_map`` that
    with heat maps.

    With ``auto`` no boxes are given and pipelines find people by themselves; without it they only
    track who is given.  Pipelines of sequences with several people have a slot for each of them.
    ``fixed`` are the parameters (``stage.name``) that are not changed for that.
    """

    sequences: ListLike[Sequence]
    make_pipeline: Callable[[Any], Runnable]
    clock: Callable[[], float]
    restarts: bool = False
    warm: bool = False
    likelihood: str = ''
    heat_map: str = ''
    progress: Progress = lambda items, name, total: iter(items)
    auto: bool = False
    fixed: frozenset[str] = frozenset()

    def evaluate(self, config: Any, out: Path | None = None, name: str = '') -> dict[str, Any]:
        """
        Run a configuration over all sequences.

        :param config: of the pipeline.
        :param out: folder for masks and contact sheets, in a folder per sequence.
        :param name: of the configuration, for the progress.
        :returns: ``sequences`` (name -> numbers), ``mean``, and ``restarts`` if asked for.
        :raises SequenceError: if an image cannot be read or written.
        """
        rows: dict[str, Any] = {}
        kinds = [name for name in ('restarts', 'warm') if getattr(self, name)]
        starts: dict[str, dict[str, list[StartScore]]] = {kind: {} for kind in kinds}
        for sequence in self.sequences:
            title = f'{name} {sequence.name}'.strip()
            rows[sequence.name] = self._run(config, sequence, out, title)
            for kind in kinds:
                single = self._suited(config, 1, auto=False)
                runs = run_restarts(
                    lambda single=single: self.make_pipeline(single),  # type: ignore[misc]
                    sequence,
                    clock=self.clock,
                    likelihood_name=self.likelihood,
                    heat_map_name=self.heat_map,
                    warm=kind == 'warm',
                )
                count = len(restarts_of(sequence))
                starts[kind][sequence.name] = list(self.progress(runs, f'{title} {kind}', count))
        report: dict[str, Any] = {'sequences': rows, 'mean': mean_of(rows)}
        return report | {kind: restart_report(starts[kind]) for kind in kinds}

    def _run(
        self, config: Any, sequence: Sequence, out: Path | None, title: str
    ) -> dict[str, Any]:
        attendance, starts = sequence.attendance, {} if self.auto else sequence.starts
        slots = len(attendance.people) if sequence.label_files else 0
        config = self._suited(config, slots, auto=self.auto)
        summary = Summary(TrackingScore(attendance, first_frames(attendance, starts)))
        output = None if out is None else SequenceOutput(out / sequence.name, sequence)
        outcomes = run_sequence(
            self.make_pipeline(config),
            sequence,
            clock=self.clock,
            likelihood_name=self.likelihood,
            heat_map_name=self.heat_map,
            auto=self.auto,
        )
        for outcome in self.progress(outcomes, title, len(sequence.numbers)):
            summary.add(outcome, sequence.labels(outcome.number))
            if output is not None:
                output.add(outcome)
        if output is not None:
            output.close()
        return summary.numbers()

    def _suited(self, config: Any, slots: int, *, auto: bool) -> Any:
        """Return a configuration with a number of slots (0 as it is) that starts by itself."""
        changes: dict[tuple[str, str], Any] = {
            ('starting', 'auto_init'): 'motion' if auto else 'none'
        }
        if slots > 0:
            changes['people', 'max_people'] = slots
        for (stage, name), value in changes.items():
            if f'{stage}.{name}' not in self.fixed:
                config = replaced(config, stage, name, value)
        return config

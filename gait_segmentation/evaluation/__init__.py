# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""
Evaluation: sequences on disk, metrics, pictures and reports.

The command ``gait_evaluate`` is a thin shell round :class:`Session`.
"""

from gait_segmentation.evaluation.metrics import (
    FrameScore,
    boundary_f,
    error_percent,
    evaluation_window,
    jaccard,
    score_frame,
    start_box,
    true_box,
)
from gait_segmentation.evaluation.restarts import run_restarts
from gait_segmentation.evaluation.runner import Outcome, run, run_sequence
from gait_segmentation.evaluation.sequence import Sequence
from gait_segmentation.evaluation.session import Session, load_sequences

__all__ = [
    'FrameScore',
    'Outcome',
    'Sequence',
    'Session',
    'boundary_f',
    'error_percent',
    'evaluation_window',
    'jaccard',
    'load_sequences',
    'run',
    'run_restarts',
    'run_sequence',
    'score_frame',
    'start_box',
    'true_box',
]

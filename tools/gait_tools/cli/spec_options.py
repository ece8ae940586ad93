# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Options of the command line for the parameters of what a bank or a vocabulary is made by."""

from __future__ import annotations

import argparse
from typing import Any

from gait_segmentation.config import StageConfig, parameters_of


def add_spec_options(parser: argparse.ArgumentParser, spec: type[StageConfig], title: str) -> None:
    """Add an option for each parameter of a specification, to be read by :func:`spec_of`."""
    group = parser.add_argument_group(title)
    for about in parameters_of(spec):
        unit = f' [{about.unit}]' if about.unit else ''
        default = f'{about.default:g}' if about.type is float else about.default
        group.add_argument(
            f'--{about.name.replace("_", "-")}',
            dest=about.name,
            type=about.type,
            default=argparse.SUPPRESS,
            metavar={int: 'N', float: 'X', str: 'NAMES'}[about.type],
            help=f'{about.description}{unit} Default: {default}.'.replace('%', '%%'),
        )


def spec_of(options: argparse.Namespace, spec: type[StageConfig]) -> dict[str, Any]:
    """Return the parameters of a specification that were given."""
    names = [about.name for about in parameters_of(spec)]
    return {name: getattr(options, name) for name in names if hasattr(options, name)}

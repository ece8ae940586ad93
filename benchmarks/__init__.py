# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The programs behind the figures in the docs, and what they are run on; not installed."""


def holds(what: str, value: float, bar: float, *, least: bool = False, more: str = '') -> bool:
    """
    Print a figure beside its bar, and return whether it meets it.

    :param least: whether the bar is the least that the figure must be, and not the most.
    :param more: what else to say of it.
    """
    met = value >= bar if least else value <= bar
    sign = '>=' if least else '<='
    print(f'{"ok  " if met else "MISS"} {what}: {value:.4g} {sign} {bar:g} {more}', flush=True)
    return met

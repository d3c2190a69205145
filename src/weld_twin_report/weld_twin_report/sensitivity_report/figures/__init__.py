# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The figures of the study: a table, a picture and a sentence each."""

from collections.abc import Callable

from weld_twin_core.errors import DataError

from ..setting import RECORDED, Setting
from . import paths, sizes
from .canvas import Drawing

__all__ = ['FIGURES', 'Drawing', 'draw', 'drawable']

FIGURES: dict[str, Callable[[Setting], Drawing | None]] = {
    '6': paths.baseline,
    '7': paths.initialization,
    '8': paths.profiles,
    '9': paths.play,
    '10': sizes.angles,
    '11': sizes.combined,
    '12': sizes.joints,
    '13': sizes.widths,
    '14': sizes.drift,
    'posture': paths.standing,
    'recorded': paths.recorded,
}
"""By the number the paper gives them, or a name."""
_PLANNED_ONLY = ('6', '8')


def drawable(setting: Setting) -> tuple[str, ...]:
    """Return the figures a setting has: some need planned motions, one needs a recording."""
    left_out = _PLANNED_ONLY if RECORDED in setting.studies else ('recorded',)
    return tuple(key for key in FIGURES if key not in left_out)


def draw(setting: Setting, key: str) -> Drawing | None:
    """Return a figure; None where the recording holds no measurements to draw."""
    if key not in FIGURES:
        raise DataError(f'no figure is called {key!r}; there are ' + ', '.join(FIGURES))
    if key not in drawable(setting):
        what = 'a recording' if key in _PLANNED_ONLY else 'a planned seam'
        raise DataError(f'figure {key} cannot be drawn of {what}')
    return FIGURES[key](setting)

# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Does a corrected program keep a tolerance all along, and what would make that sure?"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from weld_twin_core.diagnosis.predicting.planned import Wanted, plan_more
from weld_twin_core.errors import DataError
from weld_twin_core.recording import JointMotion, Recording
from weld_twin_core.twin.features import Features
from weld_twin_core.twin.program_accuracy import SURE, along_seams, conforms
from weld_twin_core.twin.program_model import ProgramModel

from .correcting import CorrectedProgram

MORE = (5, 10, 20, 40)
"""Numbers of postures that are tried, fewest first: a measurement is no finer planned than that."""
OFFERED = 60
"""Postures along a program of which those to measure are chosen."""


def tolerance_entry(
    made: CorrectedProgram, model: ProgramModel, tolerance: float, noise: float
) -> dict[str, Any]:
    """
    Return how probably the tool keeps a tolerance all along, before and after, as plain JSON values.

    model: it was corrected with.
    tolerance: of the tool's distance from where the program means it [m].
    noise: standard deviation of a measured coordinate, of postures measured in addition [m].

    Raises DataError: the tolerance means nothing, or the model does not say how sure it is.
    """
    if not 0.0 < tolerance < 1.0:
        raise DataError(f'--tolerance must be above zero, got {tolerance * 1e3:g} mm')
    reported = {}
    for name, value in zip(('before', 'after'), made.accuracy, strict=True):
        if value is None or value.worsts is None:
            raise DataError('--tolerance needs a model that says how sure it is: a diagnosis.json')
        probability = float(value.within(tolerance) or 0.0)
        reported[name] = {
            'probability': probability,
            'decision': conforms(probability),
            'sure_within_m': value.sure_within,
        }
    more = None
    if reported['after']['decision'] != 'kept':
        more = _postures_more(made, model, tolerance, noise)
    return {'tolerance_m': tolerance, **reported, 'postures_more': more}


def _postures_more(
    made: CorrectedProgram, model: ProgramModel, tolerance: float, noise: float
) -> int | None:
    """Return how many postures measured along the program make it sure; None where none do."""
    assert model.posterior is not None
    q = np.concatenate([piece.motion.q for piece in made.found.travel.pieces])
    postures = q[np.unique(np.linspace(0, len(q) - 1, min(OFFERED, len(q))).round().astype(int))]
    twin = model.twin(made.found.travel.pieces[0].moves[0].tool)
    count = min(MORE[-1], len(postures))
    wanted = Wanted(tolerance, noise)
    stations = plan_more(model.posterior, twin, (postures, postures), count, wanted).q
    for number in MORE:
        if number > len(stations):
            break
        t = np.arange(float(number))
        still = Recording('stations', JointMotion(t, stations[:number], static=True))
        surer = replace(
            model, posterior=model.posterior.after(Features(twin, still, t), noise), _twins={}
        )
        drawn = tuple(surer.drawn(piece, piece.motion) for piece in made.found.travel.pieces)
        _, after = along_seams(replace(made.found, drawn=drawn))
        if after is not None and (after.within(tolerance) or 0.0) >= SURE:
            return number
    return None

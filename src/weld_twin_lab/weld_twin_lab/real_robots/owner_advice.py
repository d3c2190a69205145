# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What an owner of the arm should do, in sentences that follow from its figures."""

from __future__ import annotations

import numpy as np

from weld_twin_core.diagnosis.result import Diagnosis
from weld_twin_core.effects import Effect
from weld_twin_nodes.wording.quantities import millimetres
from weld_twin_nodes.wording.words import listed
from weld_twin_report.report.family_table import ripples

_GEOMETRY = {'joint_offset', 'link_length', 'link_offset', 'link_twist', 'axis_parallelism'}


def owner_advice(diagnosis: Diagnosis) -> list[str]:
    """Return what to do, the most worthwhile first."""
    out = [
        'Load the corrected geometry (export diagnosis.json as urdf or offsets) into the '
        f'controller or planner; geometry {_share(diagnosis, _GEOMETRY)}.',
    ]
    strong = sorted(ripples(diagnosis), key=lambda r: -r.rms)[:2]
    if strong:
        out.append(
            'Send compensated joint commands (weld-twin correct) for the rest: ripple of the '
            f'gears, most of it in {listed([r.joint for r in strong])}, is repeatable but no '
            'controller has a parameter for it. Measure anew after a gearbox was exchanged.'
        )
    settling = _first(diagnosis, 'setup_settling')
    if settling is not None:
        size = float(np.linalg.norm(np.atleast_1d(settling.xyz)))  # type: ignore[attr-defined]
        out.append(
            f'The set-up crept by {millimetres(size)} while it was measured, with a time constant '
            f'of {settling.time_constant:.0f} stations: '  # type: ignore[attr-defined]
            'warm up arm, stand and tracker before measuring, and come back to a reference pose '
            'now and then.'
        )
    step = _first(diagnosis, 'setup_step')
    if step is not None:
        out.append(
            f'About station {step.time:.0f} '  # type: ignore[attr-defined]
            'base or tracker moved a little: check their fixtures.'
        )
    out.append(
        f'Do not expect less than {millimetres(diagnosis.gap.noise_floor_m)}, the noise of arm '
        f'and instrument; what remains above it, up to {millimetres(diagnosis.shrink.rms_after_m)}'
        ', follows no joint, direction, load, time or place that was looked at.'
    )
    return out


def blind_spots(diagnosis: Diagnosis) -> list[str]:
    """Return what these data cannot tell apart or cannot show."""
    out = []
    names = [f.effect for f in diagnosis.families if not f.named]
    if names:
        out.append(
            f'{listed([n.replace("_", " ") for n in names])}: unseen poses are predicted as well '
            'without them, for the other kinds take their place. None of them is proven or ruled '
            'out.'
        )
    robot, q = diagnosis.model.robot, diagnosis.recordings[0].joints.q
    wide = []
    for i, name in enumerate(robot.joint_names):
        span = float(np.ptp(np.percentile(q[:, i], [0.5, 99.5])))
        if span < 2.0 * np.pi:
            wide.append(f'{name} {2.0 * np.pi / max(span, 1e-9):.1f}')
    if wide:
        out.append(
            'Single ripple orders of joints that do not make a full turn: only orders that differ '
            f'by more than {", ".join(wide)} are apart, so order and amplitude are one of many '
            'ways to write the same error over the range that was moved.'
        )
    if all(r.measured is not None and r.measured.rotation is None for r in diagnosis.recordings):
        out.append(
            f'{robot.joint_names[-1]}: with positions only and a reflector near its axis nothing '
            'of its own can be seen.'
        )
    if _first(diagnosis, 'setup_settling') is not None:
        out.append(
            'Whether base, instrument or the arm itself crept while warming up: a common motion '
            "of all poses is one and the same in these data. It is taken as the set-up's and not "
            'carried over to other recordings.'
        )
    return out


def _share(diagnosis: Diagnosis, names: set[str]) -> str:
    size = float(np.sqrt(sum(f.rms_m**2 for f in diagnosis.families if f.effect in names)))
    return f'accounts for {millimetres(size)}'


def _first(diagnosis: Diagnosis, name: str) -> Effect | None:
    return next((e for e in diagnosis.model.found if e.name == name), None)

# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The whole study: local, global, stack and advice, as one tree of plain data."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from weld_twin_core import sensitivity
from weld_twin_core.metrics.deviation import root_mean_square
from weld_twin_core.sensitivity import (
    MorrisDesign,
    Outcomes,
    SobolDesign,
    Study,
    ToleranceStack,
)
from weld_twin_nodes.offline.task_pool import Runner, Task

from .setting import RECORDED, Setting, recorded_deviations
from .work import (
    Design,
    Job,
    StackDesign,
    local,
    placement,
    profiles,
    run_all,
    sweeps,
)

SCHEMA = 'weld_twin/sensitivity/1'
OUTPUTS = ('d_norm', 'across_m', 'stickout_m')
"""What Sobol indices are given of."""


def run_study(
    setting: Setting, runner: Runner, meanwhile: Callable[[], object] | None = None
) -> dict[str, Any]:
    """Return everything the study finds; ``meanwhile`` is done while workers run its tasks."""
    out: dict[str, Any] = {'schema': SCHEMA, 'setting': setting.describe(), 'motions': {}}
    designs = {name: _Designs(setting, name) for name in setting.studies}
    asked = _pieces(setting)
    jobs = {k: v for name, d in designs.items() for k, v in d.jobs(setting.studies[name]).items()}
    result, done = run_all(runner, jobs, list(asked.values()), meanwhile)
    pieces = dict(zip(asked, done, strict=True))
    for name, design in designs.items():
        out['motions'][name] = {
            'local': pieces[name, 'local'],
            'sweeps': pieces[name, 'sweeps'],
            'global': design.results(result),
        }
    if setting.path is not None:
        out['advice'] = {
            'profiles': pieces['', 'profiles'],
            'placement': pieces['', 'placement'],
        }
    if RECORDED in setting.studies:
        stacked = result[designs[RECORDED].stack_label][0]
        out['recorded'] = _recorded(setting, stacked)
    return out


def _pieces(setting: Setting) -> dict[tuple[str, str], Task]:
    """Return the tasks that are one piece each, the longest first."""
    tasks: dict[tuple[str, str], Task] = {}
    tolerances = setting.tolerances
    if setting.path is not None:
        seam = setting.robot, setting.path, tolerances
        tasks['', 'placement'] = Task(
            placement,
            (*seam, setting.torch, setting.effort.placements, setting.effort.seed),
            'placement',
        )
        tasks['', 'profiles'] = Task(profiles, seam, 'profiles')
    for name, study in setting.studies.items():
        tasks[name, 'local'] = Task(local, (study, tolerances), f'{name}: local')
        tasks[name, 'sweeps'] = Task(sweeps, (study, tolerances), f'{name}: sweeps')
    return tasks


class _Designs:
    """The runs of one motion: Sobol by parameter, effect and joint, Morris, the stack."""

    def __init__(self, setting: Setting, motion: str) -> None:
        self._setting, self._motion = setting, motion
        effort, tolerances = setting.effort, setting.tolerances
        names = tuple(t.name for t in tolerances)
        groupings = {
            'parameter': None,
            'effect': tuple(t.effect for t in tolerances),
            'joint': tuple(t.site for t in tolerances),
        }
        self._sobol = {
            by: SobolDesign(names, effort.samples, groups, effort.seed)
            for by, groups in groupings.items()
            if groups is None or len(set(groups)) > 1
        }
        self._effects = tuple(dict.fromkeys(t.effect for t in tolerances))
        self._morris = MorrisDesign(names, effort.trajectories, effort.seed)

    @property
    def stack_label(self) -> str:
        """Return the label of the runs of the tolerance stack."""
        return self._label('stack')

    def _label(self, what: str) -> str:
        return f'{self._motion}: {what}'

    def jobs(self, study: Study) -> dict[str, Job]:
        """Return designs to run, by label."""
        effort, tolerances = self._setting.effort, self._setting.tolerances
        stack = StackDesign(effort.runs, len(tolerances), effort.seed)
        designs: dict[str, Design] = {
            **{f'Sobol by {by}': design for by, design in self._sobol.items()},
            'Morris': self._morris,
            'stack': stack,
        }
        out: dict[str, Job] = {
            self._label(what): (study, tolerances, design, None)
            for what, design in designs.items()
        }
        for effect in self._effects:
            halved = sensitivity.scaled(tolerances, {effect: 0.5})
            out[self._label(f'{effect} halved')] = study, tolerances, stack, halved
        return out

    def results(self, result: dict[str, tuple[Outcomes, float]]) -> dict[str, Any]:
        """Return indices, measures and percentiles."""
        sobol = {
            by: _indices(design, result[self._label(f'Sobol by {by}')][0])
            for by, design in self._sobol.items()
        }
        screened = self._morris.screening(result[self._label('Morris')][0].d_norm)
        stacked, error = result[self.stack_label]
        stack = self._stack(stacked)
        halved = {
            effect: self._stack(result[self._label(f'{effect} halved')][0]).as_dict()
            for effect in self._effects
        }
        return {
            'model_error': error,
            'sobol': sobol,
            'morris': screened.as_dict(),
            'stack': stack.as_dict(),
            'halved': halved,
        }

    def _stack(self, runs: Outcomes) -> ToleranceStack:
        setting = self._setting
        return sensitivity.tolerance_stack(runs, setting.weld, seed=setting.effort.seed)


def _indices(design: SobolDesign, result: Outcomes) -> dict[str, Any]:
    out = {}
    for key in OUTPUTS:
        values = getattr(result, key)
        # An error may leave a direction alone altogether, as a purely planar one does.
        if np.ptp(values) > 1e-15:
            out[key] = design.indices(values).as_dict()
    return out


def _recorded(setting: Setting, stacked: Outcomes) -> dict[str, Any] | None:
    """Return the deviations that were measured, beside those the tolerances lead to expect."""
    study = setting.studies[RECORDED]
    off = recorded_deviations(study)
    if off is None:
        return None
    size = np.linalg.norm(off, axis=1)
    across, stickout = np.abs(off[:, 1]).max(), np.abs(off[:, 2]).max()
    return {
        't_s': study.t,
        's_m': study.s,
        'deviation_m': off,
        'max_m': size.max(),
        'rms_m': root_mean_square(size),
        'd_norm': size.max() / study.length,
        'across_m': across,
        'stickout_m': stickout,
        'inside': {
            'across': bool(across <= setting.weld.across_m),
            'stickout': bool(stickout <= setting.weld.stickout_m),
        },
        'share_of_runs_below': {
            'max': float((stacked.max_m < size.max()).mean()),
            'rms': float((stacked.rms_m < root_mean_square(size)).mean()),
        },
    }

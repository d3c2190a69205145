# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A sensitivity study as tasks, functions of plain arguments to plain data, and the tree they make."""

from base64 import b64decode, b64encode
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from weld_twin_core import sensitivity
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.metrics.deviation import root_mean_square
from weld_twin_core.motion.paths import Path, Torch, default_seam
from weld_twin_core.sensitivity import (
    Model,
    MorrisDesign,
    Outcomes,
    SobolDesign,
    Study,
    Tolerance,
    ToleranceStack,
)
from weld_twin_core.sensitivity.local import posture
from weld_twin_core.sensitivity.seam_study import joined
from weld_twin_core.sensitivity.sweep import end_of_linearity
from weld_twin_nodes.offline.task_pool import Runner, Task, digest

from .setting import RECORDED, Setting, recorded_deviations

BLOCK = 32_768
"""Runs of one task: with their results they take some ten megabytes and a part of a second."""
_KEPT = 2
"""Models that a worker keeps: one for each motion of a seam."""
_models: dict[str, Model] = {}
"""What a worker made last, by content: it sees the same study many times."""


@dataclass(frozen=True)
class StackDesign:
    """Which runs a tolerance stack needs: independent ones, as many as were asked for."""

    runs: int
    inputs: int
    seed: int = 0

    def samples(self) -> Array:
        """Return probabilities of every input, shape (runs, P)."""
        return sensitivity.probabilities(self.runs, self.inputs, self.seed)


Design = SobolDesign | MorrisDesign | StackDesign
"""Which runs are wanted: small to send, where its samples are not."""


def count_of(design: Design) -> int:
    if isinstance(design, SobolDesign):
        return design.base_samples * (len(design.labels) + 2)
    if isinstance(design, MorrisDesign):
        return design.trajectories * (len(design.names) + 1)
    return design.runs


@lru_cache(maxsize=1)
def _samples(design: Design) -> Array:
    return design.samples()


def run_packed(
    study: Study,
    tolerances: tuple[Tolerance, ...],
    design: Design,
    start: int,
    drawn: tuple[Tolerance, ...] | None = None,
) -> dict[str, Any]:
    """
    Return what a block of a design's runs comes to, `packed`, and how exact the model is.

    The model of wider tolerances holds for narrower ones that the runs are ``drawn`` from.
    """
    key = digest(study, tolerances)
    if key not in _models:
        while len(_models) >= _KEPT:
            del _models[next(iter(_models))]
        _models[key] = sensitivity.model(study, tolerances)
    model = _models[key]
    block = _samples(design)[start : start + BLOCK]
    result = model(sensitivity.draws_at(drawn or tolerances, block))
    return {'model_error': model.error, 'outcomes': packed(result)}


def packed(result: Outcomes) -> str:
    """Return outcomes as text, without the digits that take most of the time of a fast model."""
    return b64encode(np.ascontiguousarray(result, dtype='<f8').tobytes()).decode()


def unpacked(text: str) -> Outcomes:
    """Return the outcomes that were `packed`, exactly."""
    rows = np.frombuffer(b64decode(text), dtype='<f8').reshape(len(Outcomes._fields), -1)
    return Outcomes(*rows)


def local(study: Study, tolerances: tuple[Tolerance, ...]) -> dict[str, Any]:
    """Return the local sensitivities, and how the arm stands."""
    result = sensitivity.local_sensitivity(study, tolerances)
    stand = posture(study)
    return {
        **result.as_dict(),
        'posture': {'s_m': study.s, **asdict(stand)},
        'expected_m': sensitivity.expected_deviation(study, tolerances),
    }


def sweeps(study: Study, tolerances: tuple[Tolerance, ...]) -> list[dict[str, Any]]:
    """Return the deviation over the size of every error, and where it stops being linear."""
    out = []
    for tolerance in tolerances:
        result = sensitivity.sweep(study, tolerance, sensitivity.default_values(tolerance))
        end = None
        if tolerance.unit == 'rad' and tolerance.effect != 'backlash':
            end = end_of_linearity(study, tolerance)
        out.append({**result.as_dict(), 'linear_up_to': end})
    return out


def profiles(robot: Robot, path: Path, tolerances: tuple[Tolerance, ...]) -> list[dict[str, Any]]:
    """Return what the time laws do to the seam, with a lag of every joint besides."""
    lag = sensitivity.default_tolerances(robot, ('servo_lag',))
    wanted = {t.name: t for t in (*lag, *tolerances)}
    result = sensitivity.compare_profiles(robot, path, tuple(wanted.values()))
    still = sensitivity.compare_profiles(robot, path, tolerances)
    return [
        {**asdict(a), 'expected_without_lag_m': b.expected_m}
        for a, b in zip(result, still, strict=True)
    ]


def placement(
    robot: Robot,
    path: Path,
    tolerances: tuple[Tolerance, ...],
    torch: Torch,
    tries: int,
    seed: int,
) -> list[dict[str, Any]]:
    """Return the best torch rotation and base placement."""
    outcome = sensitivity.advise(robot, path, tolerances, torch=torch, tries=tries, seed=seed)
    return [result.as_dict() for result in outcome]


def claim_case(robot: Robot, seam: str, seed: int) -> dict[str, float]:
    """Return the measurements of a robot on a bundled seam that decide the claims."""
    # A study without claims does without what they bring along.
    from weld_twin_core.sensitivity.claims import measure_case

    return measure_case(robot, default_seam(robot, seam), seed)


Job = tuple[Study, tuple[Tolerance, ...], Design, tuple[Tolerance, ...] | None]
"""A study, its tolerances, its runs, and what they are drawn from if from narrower ones."""


def run_all(
    runner: Runner,
    jobs: dict[str, Job],
    pieces: Sequence[Task] = (),
    meanwhile: Callable[[], object] | None = None,
) -> tuple[dict[str, tuple[Outcomes, float]], list[Any]]:
    """
    Return what the runs of every job come to with the largest error of its model, and the pieces.

    The pieces are begun first, the longest in front: what is left for the end is short then.
    """
    tasks, owners = list(pieces), []
    for label, (study, tolerances, design, drawn) in jobs.items():
        count = count_of(design)
        for start in range(0, count, BLOCK):
            text = f'{label}: runs {start} to {min(start + BLOCK, count)}'
            tasks.append(Task(run_packed, (study, tolerances, design, start, drawn), text))
            owners.append(label)
    parts: dict[str, list[dict[str, Any]]] = {label: [] for label in jobs}
    results = runner.run(tasks, meanwhile)
    for label, result in zip(owners, results[len(pieces) :], strict=True):
        parts[label].append(result)
    outcome = {
        label: (joined([unpacked(part['outcomes']) for part in own]), own[0]['model_error'])
        for label, own in parts.items()
    }
    return outcome, results[: len(pieces)]


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
        out['advice'] = {name: pieces['', name] for name in ('profiles', 'placement')}
    if RECORDED in setting.studies:
        stacked = result[designs[RECORDED].label('stack')][0]
        out['recorded'] = _recorded(setting, stacked)
    return out


def _pieces(setting: Setting) -> dict[tuple[str, str], Task]:
    """Return the tasks that are one piece each, the longest first."""
    tasks: dict[tuple[str, str], Task] = {}
    tolerances = setting.tolerances
    if setting.path is not None:
        seam = setting.robot, setting.path, tolerances
        how = (setting.torch, setting.effort.placements, setting.effort.seed)
        tasks['', 'placement'] = Task(placement, (*seam, *how), 'placement')
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

    def label(self, what: str) -> str:
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
            self.label(what): (study, tolerances, design, None) for what, design in designs.items()
        }
        for effect in self._effects:
            halved = sensitivity.scaled(tolerances, {effect: 0.5})
            out[self.label(f'{effect} halved')] = study, tolerances, stack, halved
        return out

    def results(self, result: dict[str, tuple[Outcomes, float]]) -> dict[str, Any]:
        """Return indices, measures and percentiles."""
        sobol = {
            by: _indices(design, result[self.label(f'Sobol by {by}')][0])
            for by, design in self._sobol.items()
        }
        screened = self._morris.screening(result[self.label('Morris')][0].d_norm)
        stacked, error = result[self.label('stack')]
        stack = self._stack(stacked)
        halved = {
            effect: self._stack(result[self.label(f'{effect} halved')][0]).as_dict()
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

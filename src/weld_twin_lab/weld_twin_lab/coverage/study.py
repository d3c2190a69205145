# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""All that is promised of recordings, cases, programs, touches, years and plans, and what it came to."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np

from weld_twin_core.arm import catalog
from weld_twin_core.diagnosis import Diagnosis, diagnose
from weld_twin_core.diagnosis.predicting.allowed import corrected_sigma
from weld_twin_core.diagnosis.predicting.planned import (
    JUDGED,
    SPREAD,
    clear_postures,
    plan_stations,
)
from weld_twin_core.errors import DataError, TwinError
from weld_twin_core.recording import JointMotion, Recording
from weld_twin_core.twin.posterior import expected_poses, largest_sigma
from weld_twin_msgs_py.files.markdown import table
from weld_twin_nodes.offline.task_pool import Task

from ..blind.blind_cell import at_stations
from ..blind.cause_sizes import small_errors
from ..blind.scoring import measured_of, rms
from ..plant.tracker import Tracker
from ..programs.sealed_seams import CELLS
from ..real_arms.sources import TUNED_ON, Split, all_splits
from ..real_arms.unseen import ALIGN, plain_fit, residual
from ..study import Study, head, require_simulator, shown, tabled
from .others import of_seam, of_touches, of_years
from .sealed import held, of_case, told_shrink

ARMS = ('ur5', 'ur10', 'kuka_kr6_r900', 'abb_irb1600')
COUNTS = (16, 24, 40)
"""Stations of a plan."""
NOISE = 3e-5
"""Of every measured coordinate [m]."""
TOLERANCE = 2e-4
"""Of the tool [m]; plans are asked how probably it is kept."""
UNSEEN = 60
"""Other postures of the region, at which the corrected arm is judged."""
FRAMES = [
    {'effect': 'base_pose', 'xyz': [0.01, -0.02, 0.015], 'rotvec': [0.01, -0.008, 0.02]},
    {'effect': 'tool_pose', 'xyz': [0.004, 0.003, -0.006], 'rotvec': [0.0, 0.0, 0.0]},
]
"""Where instrument and reflector really are: not known to the diagnosis."""


def carried_out(seed: int) -> dict[str, Any]:
    """
    Return what a plan promised, what the diagnosis of its stations warns of, and what an arm keeps.

    The arm is corrected with the effects in the middle of the allowed models.
    """
    rng = np.random.default_rng(seed)
    robot = catalog.load(ARMS[seed % len(ARMS)])
    count = COUNTS[seed // len(ARMS) % len(COUNTS)]
    plan = plan_stations(robot, count, TOLERANCE, NOISE)
    flaws = [*FRAMES, *small_errors(robot, rng)]
    noisy = Tracker(sigma=NOISE, orientation=False)
    seen = at_stations(robot, flaws, plan.q, noisy, rng)
    motion = JointMotion(seen.t, plan.q, static=True)
    found = diagnose(Recording('plan', motion, seen), robot, align='base,tool')
    others = clear_postures(robot, SPREAD)[-UNSEEN:]
    true = at_stations(robot, flaws, others, Tracker(orientation=False), rng).position
    assert found.posterior is not None
    still = Recording('others', JointMotion(np.arange(float(len(others))), others, static=True))
    middle, _ = expected_poses(found.posterior, found.model.twin(0), still, still.joints.t)
    off = true - middle.position
    judged = clear_postures(robot, SPREAD)[:JUDGED]
    return {
        'seed': seed,
        'robot': robot.name,
        'stations': count,
        'status': found.status,
        'promised_sigma_m': float(plan.sigma[-1]),
        'promised_elsewhere_m': float(plan.elsewhere[-1]),
        'warned_sigma_m': corrected_sigma(found.posterior, found.model, judged),
        'warned_elsewhere_m': found.posterior.anywhere_m,
        'promised_within': float(plan.within[-1]),
        'kept_sigma_m': float(largest_sigma(np.einsum('mi,mj->ij', off, off)[None] / len(off))[0]),
        'kept_within': float((np.linalg.norm(off, axis=1) < TOLERANCE).mean()),
    }


APART = 10_000
"""How far apart the seeds of what is drawn by one number are."""
UR5_NOISE = 2e-5
"""A GTS3800 is good to 15 um + 6 um/m, a metre or two away [m]."""


@lru_cache(maxsize=1)
def _splits(ur5: str, ur10: str) -> dict[str, Split]:
    return {split.name: split for split in all_splits(Path(ur5), Path(ur10))}


def tasks_of(args: Any) -> list[Task]:
    """Return what is to be tried, in the order that it is told; raises DataError."""
    seed, asked = args.seed, list[tuple[str, Callable[..., Any], tuple[Any, ...]]]()
    for name in _splits(args.ur5, args.ur10) if args.ur5 else ():
        asked.append((name, _of_split, (args.ur5, args.ur10, name)))
    arms = len(asked)
    asked += [(f'case {k}', of_case, (seed, k)) for k in range(args.cases)]
    asked += [
        (f'{language} {k}', of_seam, (language, seed, k))
        for k in range(args.seams)
        for language in CELLS
    ]
    asked += [(f'touches {k}', of_touches, (APART * seed + k,)) for k in range(args.touches)]
    asked += [(f'years {k}', of_years, (seed, k)) for k in range(args.cells)]
    asked += [(f'plan {k}', carried_out, (APART * seed + k,)) for k in range(args.plans)]
    if len(asked) > arms:
        require_simulator()
    return [Task(simulated, (make, given), label) for label, make, given in asked]


def simulated(make: Callable[..., Any], given: tuple[Any, ...]) -> Any:
    """Return what is made; None where the plant's springs are too stiff to be simulated."""
    try:
        return make(*given)
    except FloatingPointError:
        return None


def _of_split(ur5: str, ur10: str, name: str) -> dict[str, Any]:
    """Return what the regions of one poor recording hold, inside and outside of it."""
    split = _splits(ur5, ur10)[name]
    group = 'tuned on' if split.robot == 'ur5' and split.kind in TUNED_ON else 'unseen'
    entry: dict[str, Any] = {'name': split.name, 'source': split.robot, 'group': group}
    try:
        found = diagnose([split.train], catalog.load(split.robot), align=ALIGN)
    except TwinError as error:
        return {**entry, 'refused': str(error)}
    entry['status'] = found.status
    if found.posterior is None:
        return entry
    for region, other in (('inside', split.inside), ('outside', split.outside)):
        if other is not None:
            seen = measured_of(other)
            noise = np.full(seen.t.size, UR5_NOISE) if seen.sigma is None else seen.sigma
            entry[region] = held(found, split.train, other, noise)
            told = _of_shrink(split, other, found, region)
            entry.setdefault('promises', {})[f'shrink on the real arms, {region} (95 %)'] = [told]
    return entry


def _of_shrink(split: Split, other: Recording, found: Diagnosis, region: str) -> dict[str, Any]:
    """Return the shrink that is told of a split, and that on stations that were not fitted."""
    assert found.shrink is not None
    bare = plain_fit(split.train, catalog.load(split.robot), (), frozenset(ALIGN))
    before, after = (
        rms(residual(model, split.train, other)[:3].T) for model in (bare, found.model)
    )
    told = told_shrink(found.shrink, after / before, region)
    return {**told, 'ci90': told['ci95']}


Entry = dict[str, Any]
REGIONS = ('inside', 'outside')
HEAD = """# What 90 % regions of predictions hold

Poor recordings of two measured arms, and cells of the plant, whose poses are judged where
the tool really is; [how it was done](../../predictions.md#does-it-hold).
"""


def page(entries: Sequence[Entry]) -> str:
    plans = [entry for entry in entries if 'promised_within' in entry]
    rest = [entry for entry in entries if 'source' in entry]
    rows = [
        {**entry, 'region': region, **entry[region]}
        for entry in rest
        for region in REGIONS
        if region in entry
    ]
    tables = [tabled(SUMMARIES, summaries(rest)), promise_table(rest), tabled(ENTRIES, rows)]
    if plans:
        told = ', '.join(f'{key} {value:.3g}' for key, value in of_plans(plans).items())
        tables.insert(2, f'Plans carried out: {told}.\n')
    return '\n'.join([HEAD, *tables])


def of_plans(plans: Sequence[Entry]) -> dict[str, float]:
    ratio = [e['kept_sigma_m'] / e['promised_sigma_m'] for e in plans]
    warned = [e['warned_sigma_m'] / e['promised_sigma_m'] for e in plans]
    beyond = [e['warned_elsewhere_m'] / e['promised_elsewhere_m'] for e in plans]
    return {
        'plans': len(plans),
        'kept over promised': float(np.median(ratio)),
        'worst': max(ratio),
        'warned over promised': float(np.median(warned)),
        'the same elsewhere': float(np.median(beyond)),
        'promised within tolerance': float(np.mean([e['promised_within'] for e in plans])),
        'kept': float(np.mean([e['kept_within'] for e in plans])),
    }


def promises(entries: Sequence[Entry]) -> dict[str, list[dict[str, Any]]]:
    """Return all intervals with what is true, by their kind."""
    out: dict[str, list[dict[str, Any]]] = {}
    for entry in entries:
        for kind, told in entry.get('promises', {}).items():
            out.setdefault(kind, []).extend(told)
    return {kind: told for kind, told in out.items() if told}


def promise_table(entries: Sequence[Entry]) -> str:
    rows = []
    for kind, told in promises(entries).items():
        ends = np.array([one['ci90'] for one in told])
        true = np.array([one['true'] for one in told])
        above, below = true > ends[:, 1], true < ends[:, 0]
        width = np.median((ends[:, 1] - ends[:, 0]) / np.maximum(np.abs(true), 1e-12))
        shares = (1.0 - (above | below).mean(), below.mean(), above.mean())
        rows.append((kind, true.size, *(f'{share:.1%}' for share in shares), f'{width:.3f}'))
    heads = ('interval of', 'number', 'held', 'truth below', 'above', 'width over the truth')
    return table(heads, *rows)


def summaries(entries: Sequence[Entry]) -> list[dict[str, Any]]:
    kinds = dict.fromkeys((e['source'], e['group'], r) for e in entries for r in REGIONS)
    parts = {
        kind: [
            e[kind[2]] for e in entries if (e['source'], e['group']) == kind[:2] and kind[2] in e
        ]
        for kind in kinds
    }
    return [_summary(*kind, mine) for kind, mine in parts.items() if mine]


def _summary(source: str, group: str, region: str, mine: Sequence[Entry]) -> dict[str, Any]:
    held = np.array([e['held'] for e in mine])
    known = [e for e in mine if e.get('oracle_sigma_m') and e['formal_sigma_m']]
    wider, formal = (
        [e['median_sigma_m'] / e[key] for e in known]
        for key in ('oracle_sigma_m', 'formal_sigma_m')
    )
    poses = np.array([e['poses'] for e in mine])
    return {
        'source': source,
        'group': group,
        'region': region,
        'recordings': len(mine),
        'held': float(held.mean()),
        'held_of_all_poses': float(np.average(held, weights=poses)),
        'worst': float(held.min()),
        'flagged': float(np.mean([e['flagged'] for e in mine])),
        'over_oracle': float(np.median(wider)) if wider else None,
        'over_formal': float(np.median(formal)) if formal else None,
    }


SUMMARIES: dict[str, Callable[[Any], object]] = {
    'of': itemgetter('source'),
    'group': itemgetter('group'),
    'poses': itemgetter('region'),
    'recordings': itemgetter('recordings'),
    'held': shown('held', by='{:.1%}'),
    'of all poses': shown('held_of_all_poses', by='{:.1%}'),
    'worst': shown('worst', by='{:.0%}'),
    'flagged': shown('flagged', by='{:.1%}'),
    'width over the oracle': shown('over_oracle', by='{:.2f}'),
    'over its formal one': shown('over_formal', by='{:.2f}'),
}
"""Columns of the table of summaries."""
ENTRIES: dict[str, Callable[[Any], object]] = {
    'recording': shown('name'),
    'status': itemgetter('status'),
    'poses': itemgetter('region'),
    'number': itemgetter('poses'),
    'held': shown('held', by='{:.0%}'),
    'not flagged': shown('held_unflagged', by='{:.0%}'),
    'flagged': shown('flagged', by='{:.0%}'),
    'mean error': shown('mean_error_m', by='{:.3f} mm', times=1e3),
    'sigma': shown('median_sigma_m', by='{:.3f} mm', times=1e3),
}
"""Columns of the table of recordings, each with what holds in a region of its own."""


def run(study: Study) -> None:
    args = study.args
    drawn = args.cases, args.seams, args.touches, args.cells, args.plans
    if bool(args.ur5) is not bool(args.ur10) or not (args.ur5 or any(drawn)):
        raise DataError('give --ur5 and --ur10, or how many of what is to be drawn, or both')
    entries = [e for e in study.tasks(tasks_of(args), 'holding promises') if e is not None]
    study.write('coverage', head('coverage/3', entries=entries), page(entries))

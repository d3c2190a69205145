# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What each level of an answer was worth: examples to learn belief from.

An answer is right as the blind check judges it; besides, each member of a set too wide for a name
must predict the sealed recording as the cause at work does, unless the kinematics make them one error.

Where causes of a case sit, which of them show, and what share each has, the plant alone says. Causes
in the library have their place and dependence from there. Constant errors that the kinematics of the
arm makes one and the same error may be told at any of their places.

A cause is taken out of the truth; all others and the frames may then change so that the recordings look
as they did. What still differs, there and on another motion, shows. On the recordings too: a fit that
has to reach far beyond them differs elsewhere for no cause. Where an arm is off by a little everywhere,
every name is at work. So a cause is asked how far it says that it moves the tool on a motion that was
not recorded, beside what fitted frames take up, and how much of that the errors named really do.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from weld_twin_core.arm import catalog
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arm.rotation import matrix_from_quaternion
from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis import Diagnosis
from weld_twin_core.diagnosis.algebra.motions import constant, same_error
from weld_twin_core.diagnosis.calibration.features import WIDEST
from weld_twin_core.diagnosis.result import NAMING
from weld_twin_core.diagnosis.result import Cause as Told
from weld_twin_core.effects.effect import Effect
from weld_twin_core.effects.registry import REGISTRY
from weld_twin_core.twin.features import joints_of

from ..blind.blind_cell import BlindCell, Take, deviation, exact, floor, record
from ..blind.cause_sizes import SIZES, Cause, Site, site
from ..blind.making import SealedCase
from ..blind.scoring import NOT_IN_LIBRARY, Judged, answers_of, judge, measured_of
from ..plant.exponentials import PlantRecording

HERE = 'its joint'
OUTSIDE_LEVELS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    'bearing_tilt': ((HERE,), ('angle',)),
    'station_step': (('instrument', 'base'), ('time',)),
    'tool_slip': (('tool',), ('time',)),
    'quadratic_scale': (('instrument',), ('place',)),
    'column_bend': (('base',), ('time', 'temperature')),
    'stick_slip': ((HERE,), ('direction', 'speed')),
    'friction_wander': ((HERE,), ('direction', 'time')),
    'loaded_play': ((HERE,), ('load', 'direction')),
    'dress_pack': ((HERE,), ('angle',)),
}
"""Places and dependences of the causes outside the library; the first is the one meant."""
ALSO: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    'drift': (('base', 'instrument'), ('time',)),
    'payload': (('load', 'tool'), ('load',)),
    'clock_rate': (('clock',), ('time', 'speed')),
    'gear_ratio_by_direction': ((HERE,), ('direction', 'angle')),
    'hose_pull': (('load', 'tool'), ('load',)),
}
"""The same for causes in the library whose place has more than one right word."""
LAGGING = 'equal lag'
"""Construction in which every joint lags alike: the clock is late, to whoever measures."""


class Levels(NamedTuple):
    """Right words for the place and for the dependence of one cause."""

    places: frozenset[str]
    dependences: frozenset[str]


def levels_of(truth: Mapping[str, Any]) -> list[Levels]:
    """Return the right words for every cause of a truth of `making.truth_of`, or those kept with it."""
    if 'levels' in truth:
        return [Levels(frozenset(at), frozenset(on)) for at, on in truth['levels']]
    out = [_levels(str(effect), joint, str(truth['robot'])) for effect, joint in truth['sites']]
    if truth['construction'] == LAGGING:
        out = [Levels(own.places | {'clock'}, own.dependences) for own in out]
    return out


def alike_by_structure(robot: str, site: Site) -> frozenset[Site]:
    """Return the constant errors that are always the same error as one, itself included."""
    return frozenset(_alike(robot, site))


def numbers(site: Site) -> int:
    kind = REGISTRY.get(site[0])
    return sum(max(p.size, 1) for p in kind.parameters) if kind is not None else 0


@lru_cache(maxsize=1024)
def _alike(name: str, site: Site) -> tuple[Site, ...]:
    effect, joint = site
    kind = REGISTRY.get(effect)
    if kind is None or not constant(kind):
        return (site,)
    robot = catalog.load(name)
    own = _built(kind, joint)
    others = [other for other in _constants(robot) if same_error(robot, own, other)]
    return tuple({site, *((other.name, other.site) for other in others)})


@lru_cache(maxsize=1024)
def _levels(effect: str, joint: str | None, robot: str) -> Levels:
    if effect in OUTSIDE_LEVELS or effect in ALSO:
        words, dependences = {**OUTSIDE_LEVELS, **ALSO}[effect]
        own = {str(joint) if word == HERE else word for word in words}
        return Levels(frozenset(own), frozenset(dependences))
    kind = REGISTRY[effect]
    places = {_built(REGISTRY[e], j).at for e, j in _alike(robot, (effect, joint))}
    return Levels(frozenset(places), frozenset({kind.traits.depends_on}))


def _constants(robot: Robot) -> list[Effect]:
    kinds = [kind for kind in REGISTRY.values() if constant(kind)]
    return [_built(kind, joint) for kind in kinds for joint in joints_of(kind, robot)]


def _built(kind: type[Effect], joint: str | None) -> Any:
    return kind(**({'joint': joint} if kind.of in ('joint', 'link') else {}))


VISIBLE = 25.0
"""Rise of chi-square without a cause from which on it shows: five standard deviations."""
FEW = frozenset({'double', 'triple'})
"""Kinds of cases with two or three causes."""


class Whole(NamedTuple):
    """What an answer names, against what is at work."""

    asked: tuple[frozenset[Site], ...]
    """Every visible cause that the library holds, as all that is the same error on any motion."""
    named: tuple[bool, ...]
    """Whether each of these is told, alone or in a small set."""
    right: bool
    """All of these are named, nothing else is, and where a visible cause was taken out of the
    library, something is said to be left."""


def whole(truth: Mapping[str, Any], verdict: Mapping[str, Any]) -> Whole:
    """Return an answer of any schema held against its truth, which has what every cause shows."""
    at_work = [alike_by_structure(truth['robot'], (e, j)) for e, j in truth['sites']]
    out = [
        e in truth['excluded'] or not any(own in REGISTRY for own, _ in alike)
        for (e, _), alike in zip(truth['sites'], at_work, strict=True)
    ]
    seen = [chi >= VISIBLE for chi in truth['shown']]
    asked = tuple(
        own for own, gone, shows in zip(at_work, out, seen, strict=True) if shows and not gone
    )
    groups = [{(s['effect'], s['joint']) for s in g} for g in verdict['indistinguishable']]
    small = [group for group in groups if len(group) <= WIDEST]
    named = tuple(any(own & group for group in small) for own in asked)
    every = frozenset[Site]().union(*at_work)
    # A set that holds what was taken out tells it, by what no motion tells from it.
    foreign = any(
        gone and shows and not any(own & group for group in groups)
        for own, gone, shows in zip(at_work, out, seen, strict=True)
    )
    status, rest = verdict['status'], any(cause.get('rest') for cause in verdict['causes'])
    nothing = 'none' if not any(seen) else ''
    said = (status == 'unknown' or rest) if foreign else status in (*NAMING, nothing)
    return Whole(asked, named, all(named) and said and all(group & every for group in groups))


STEP = 0.1
"""Share of a parameter by which it is changed for its column; angles by as much [rad]."""
TURNING = {'transmission_ripple': ('phase',), 'bearing_tilt': ('phase',)}
"""Parameters beside the sizes that bend a cause."""


def shown(case: SealedCase) -> list[float]:
    """
    Return for each cause by how much chi-square rises without it, the least of both kinds of motion.

    Causes are taken as linear in their parameters about the truth.
    """
    positions = replace(case.cell.tracker, orientation=False)
    cell = replace(case.cell, align=(), tracker=positions)
    takes = (case.train, *case.also, case.test)
    whole = moved(cell, case.causes, takes)
    frames = frame_columns(cell, takes, case.cell.align)
    columns = [
        [(moved(cell, new, takes) - whole) / STEP for new in changed(case.causes, k)]
        for k in range(len(case.causes))
    ]
    unseen = np.arange(whole.size) >= whole.size - moved(cell, (), takes[-1:]).size
    out = []
    for k in range(len(case.causes)):
        others = [own for j, part in enumerate(columns) if j != k for own in part]
        design = np.array([*others, *frames]).T
        gone = whole - moved(cell, [*case.causes[:k], *case.causes[k + 1 :]], takes)
        remaining = gone - design @ fitted(design[~unseen], gone[~unseen]) if design.size else gone
        out.append(min(float((remaining[part] ** 2).sum()) for part in (unseen, ~unseen)))
    return out


def fitted(design: Array, target: Array) -> Array:
    """Return least-squares coefficients; columns differ in size by orders of magnitude."""
    size = np.maximum(np.linalg.norm(design, axis=0), 1e-300)
    return np.asarray(np.linalg.lstsq(design / size, target, rcond=1e-9)[0] / size)


def moved(cell: BlindCell, causes: Sequence[Cause], takes: Sequence[Take]) -> Array:
    """Return how far causes move positions, then turns where measured, over the noise, (rows,)."""
    out = []
    for taken in takes:
        out.append(deviation(cell, causes, taken).ravel() / cell.tracker.sigma)
        if cell.tracker.orientation:
            real, ideal = (record(cell, own, taken, exact(cell.tracker)) for own in (causes, ()))
            there = Rotation.from_quat(ideal.quaternion)
            if not ideal.static:
                t = np.clip(real.t_measured, ideal.t_measured[0], ideal.t_measured[-1])
                there = Slerp(ideal.t_measured, there)(t)
            turn = (Rotation.from_quat(real.quaternion) * there.inv()).as_rotvec()
            out.append(turn.ravel() / cell.tracker.sigma_orientation)
    return np.concatenate(out)


def frame_columns(cell: BlindCell, takes: Sequence[Take], align: Sequence[str]) -> list[Array]:
    """Return the columns of the frames that are fitted, in the rows of `moved`; none that is zero."""
    seen = [record(cell, (), taken, exact(cell.tracker)) for taken in takes]
    columns = [
        np.concatenate([_frame_column(cell, own, frame, shift, turn) for own in seen])
        for frame in align
        for shift, turn in zip(np.eye(6, 3), np.eye(6, 3, -3), strict=True)
    ]
    return [column for column in columns if column.any()]


def _frame_column(
    cell: BlindCell, seen: PlantRecording, frame: str, shift: Array, turn: Array
) -> Array:
    """Return what a frame's shift or turn, (3,) each, does to one recording, over its noise."""
    if frame == 'tool':
        rotation = matrix_from_quaternion(np.asarray(seen.quaternion))
        along, about = rotation @ shift, rotation @ turn
    else:
        about = np.tile(turn, (len(seen.position), 1))
        along = shift + np.cross(about, seen.position)
    out = (along.ravel() / cell.tracker.sigma, about.ravel() / cell.tracker.sigma_orientation)
    return np.concatenate(out if cell.tracker.orientation else out[:1])


def changed(causes: Sequence[Cause], k: int) -> Iterator[list[Cause]]:
    """Yield all causes with each number of one changed a little."""
    own = causes[k]
    for key in (*SIZES[own['effect']], *TURNING.get(own['effect'], ())):
        if key not in own:
            continue
        value = np.asarray(own[key], dtype=float)
        step = STEP if key in TURNING.get(own['effect'], ()) else STEP * np.abs(value).max()
        for at in np.ndindex(value.shape):
            other = value.copy()
            other[at] += step
            yield [*causes[:k], {**own, key: other.tolist()}, *causes[k + 1 :]]


def true_shares(case: SealedCase) -> list[float]:
    """
    Return the true share of every cause of a case.

    As a diagnosis tells it: of the squared gap with its noise, what is no noise is parted by how
    far each cause moves the tool along with all of them together. One that works against the
    others takes nothing off the gap beside them, and has a share of zero. The noise is all that
    is not the causes': the instrument's, and that of stamps that jitter.
    """
    whole = deviation(case.cell, case.causes, case.train)
    noise, _ = floor(case.cell, case.causes, case.train)
    square = float((whole**2).sum(axis=-1).mean())
    along = [
        max(float((deviation(case.cell, [cause], case.train) * whole).sum(axis=-1).mean()), 0.0)
        for cause in case.causes
    ]
    explained = square / (square + noise**2) / max(sum(along), 1e-300)
    return [explained * part for part in along]


HALF = 0.5
"""Part of what is said of a cause that has to be there."""
LARGE = 0.1
"""Share of the squared gap that may be missing where it is more than noise."""


def there(case: SealedCase, found: Diagnosis) -> list[dict[str, float] | None]:
    """
    Return for every cause told what part of it is there: by its names, places and dependences.

    case: with all its errors. None of what has no name, or a name that the model does not hold.
    """
    cell = replace(case.cell, align=(), tracker=replace(case.cell.tracker, orientation=False))
    frames = np.array(frame_columns(cell, [case.test], case.cell.align)).T

    def shown(off: Array) -> Array:
        """Return a displacement (M, 3) without what fitted frames take up, in units of noise."""
        rows = off.ravel() / cell.tracker.sigma
        return np.asarray(rows - frames @ fitted(frames, rows) if frames.size else rows)

    seen = case.recorded('test', exact(cell.tracker))
    model, t = found.model, measured_of(seen).t
    whole = model.twin(0).poses(seen, t).position
    real = [shown(deviation(cell, [own], case.test)) for own in case.causes]
    sites = [site(own) for own in case.causes]
    words = levels_of({'sites': sites, 'construction': None, 'robot': case.lot.robot})

    def part_of(told: Told) -> dict[str, float] | None:
        names = [] if told.rest else [(str(own.effect), own.joint) for own, _ in told.name]
        own = [model.found[k] for k in told.members]
        gone = [e for e in own if (e.name, e.site) in names]
        if not gone:
            return None
        rest = model.with_found(tuple(e for e in model.found if e not in gone))
        said = shown(whole - rest.twin(0).poses(seen, t).position)

        def share(meant: Sequence[bool]) -> float:
            off = [rows for rows, own in zip(real, meant, strict=True) if own]
            return float(said @ np.sum(off, axis=0) / (said @ said)) if off else 0.0

        places, dependences = ({word for word, _ in of} for of in (told.place, told.dependence))
        return {
            'name': max(share([own in kind for own in sites]) for kind in _kinds(case, names)),
            'place': share([bool(own.places & places) for own in words]),
            'dependence': share([bool(own.dependences & dependences) for own in words]),
        }

    return [part_of(told) for told in found.causes]


def _kinds(case: SealedCase, names: Sequence[Site]) -> list[set[Site]]:
    """Return the sites named of every kind, and of all, with all that are the same error."""
    robot = case.lot.robot
    alike = [(own[0], alike_by_structure(robot, own)) for own in names]
    kinds = [{kind} for kind, _ in alike]
    return [
        set[Site]().union(*(each for kind, each in alike if kind in among))
        for among in (*kinds, {kind for kind, _ in alike})
    ]


def right(row: Mapping[str, Any]) -> bool:
    """
    Return whether an answer is right as a whole: all that it names is there, and no more.

    What its model misses on a sealed motion is noise then, or a tenth of the gap.
    """
    named = [own['name'] >= HALF for own in row['there'] if own is not None]
    left, floor, gap = (row['sealed'][key] for key in ('after', 'floor', 'before'))
    complete = left**2 - floor**2 <= max(floor**2, LARGE * gap**2)
    return row['verdict']['status'] in NAMING and all(named) and bool(complete)


AS_WELL = 0.05
"""Share of the noise by which a member of a set may leave more than the cause at work does."""
AS_GOOD = 1.05
"""RMS left over what the true causes leave, up to which an answer predicts as the truth does."""


class Example(NamedTuple):
    """One statement, the features it was made on, and whether it was right."""

    case: str
    """Name of the case; statements on one case are kept together."""
    kind: str
    """As `weld_twin_core.diagnosis.calibration.features.KINDS` has it."""
    features: Mapping[str, float]
    right: bool
    reported: float
    """The probability reported for it."""
    sure: bool = False
    """Whether it was reported as sure."""
    weight: float = 1.0
    """How much it counts."""


def kept(row: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a row of `trial.tried` was worth, and every statement of it as an example."""
    if row['error'] or not row['statements']:
        return {key: row.get(key) for key in ('name', 'error', 'unsound')}
    truth, verdict = row['truth'], row['verdict']
    known = {**truth, 'causes': (), 'alike': [*truth['alike'], *_absorbed(row)]}
    judgement = judge(known, {'verdict': {'effects': (), **verdict}})
    right = _right(row, judgement)
    sealed, causes = row['sealed'], verdict['causes']
    as_good = sealed['after'] < AS_GOOD * sealed['floor'] and judgement.status in NAMING
    words = levels_of(truth)
    return {
        'name': row['name'],
        'error': None,
        'engine': row['engine'],
        'kind': judgement.kind,
        'robot': judgement.robot,
        'motion': f'{judgement.motion} {row["poor"]}'.strip(),
        'truth': judgement.truth,
        'said': judgement.said,
        'sizes': list(truth['ratios']),
        'status': judgement.status,
        'confidence': verdict['confidence'],
        'sure': bool(verdict['sure']),
        'right': right,
        'honest': right or (as_good and bool(truth['sites'])),
        'named': judgement.named,
        'place': _first(causes, 'place', frozenset().union(*(own.places for own in words))),
        'dependence': _first(
            causes, 'dependence', frozenset().union(*(own.dependences for own in words))
        ),
        'family': _family(row),
        'family_shared': _family(row, shared=True),
        'seconds': row['seconds'],
        'examples': [list(one) for one in _examples(row, right)],
    }


def _right(row: Mapping[str, Any], judgement: Judged) -> bool:
    """
    Return whether an answer is right as a whole, sets held to what they predict.

    Of two or three causes those that do not show may be missing, as of four to six.
    """
    if 'there' in row:
        return right(row)
    told = judgement.right
    if 'shown' in row['truth'] and not (told and judgement.kind in FEW):
        told = whole(row['truth'], row['verdict']).right
    return told and sets_hold(row)


def _first(causes: Sequence[Mapping[str, Any]], level: str, words: frozenset[str]) -> bool:
    """Return whether the first place, or dependence, of the largest cause is right."""
    word = 'at' if level == 'place' else 'on'
    located = [cause for cause in causes if cause[level]]
    first = max(located, key=lambda cause: float(cause['share']), default=None)
    return first is not None and first[level][0][word] in words


def _family(row: Mapping[str, Any], *, shared: bool = False) -> float:
    """Return the most that a cause believes of the first family at work; shared, not of a whole set."""
    if not row['truth']['sites']:
        return 0.0
    (family, _), *_ = row['truth']['sites']
    beliefs = [0.0]
    for cause in row['verdict']['causes']:
        members = [n['probability'] for n in cause['name'] if n['effect'] == family]
        if members:
            beliefs.append(sum(members) if shared else cause['probability'])
    return max(beliefs)


def _at_work(truth: Mapping[str, Any]) -> set[tuple[str, str | None]]:
    """Return every site that may rightly be named."""
    if 'at_work' in truth:
        return {(str(effect), joint) for effect, joint in truth['at_work']}
    return {site for answer in answers_of(truth) for site in answer}


def _absorbed(row: Mapping[str, Any]) -> list[list[tuple[str, str | None]]]:
    """Return the causes at work without those that another of them contains on any motion."""
    sites = answers_of(row['truth'])[0]
    kept = [
        site
        for site in sites
        if not any(
            other != site
            and site in alike_by_structure(row['truth']['robot'], other)
            and numbers(other) > numbers(site)
            for other in sites
        )
    ]
    return [kept] if len(kept) < len(sites) else []


def sets_hold(row: Mapping[str, Any]) -> bool:
    """Return whether each member of a set too wide for a name predicts as well as the right one."""
    at_work = _at_work(row['truth'])
    floor = row['sealed']['floor']
    for group in row['sealed'].get('members', ()):
        remaining = {(item['effect'], item['joint']): item['left'] for item in group}
        right = [site for site in remaining if site in at_work]
        if len(remaining) <= WIDEST or not right:
            continue
        same = set().union(*(alike_by_structure(row['truth']['robot'], site) for site in right))
        most = min(remaining[site] for site in right) + AS_WELL * floor
        if any(value > most for site, value in remaining.items() if site not in same):
            return False
    return True


def examples_of(rows: Sequence[Mapping[str, Any]]) -> list[Example]:
    """Return every statement made on some cases, as `kept` gives them."""
    return [
        Example._make((str(row['name']), *one, float(row.get('weight', 1.0))))
        for row in rows
        for one in row.get('examples', ())
    ]


def _examples(
    row: Mapping[str, Any], whole_right: bool
) -> Iterator[tuple[str, Mapping[str, float], bool, float, bool]]:
    """Yield kind, features, whether it was right, the probability reported and whether as sure."""
    causes, at_work = row['verdict']['causes'], _at_work(row['truth'])
    if 'there' in row:
        yield from _of_many(row, whole_right)
        return
    truths = levels_of(row['truth'])
    named_right = whole_right and row['verdict']['status'] in NAMING
    nameless = row['truth']['kind'] in NOT_IN_LIBRARY and not named_right
    for said in row['statements']:
        kind, reported = said['kind'], said['probability']
        if said['cause'] is None:
            right = {'complete': complete(row), 'nameless': nameless}.get(kind, whole_right)
            sure = kind.startswith('answer') and bool(row['verdict']['sure'])
            yield kind, said['features'], right, reported, sure
            continue
        cause, level = causes[said['cause']], kind.split()[0]
        named = any((n['effect'], n['joint']) in at_work for n in cause['name'])
        if level == 'name':
            right = named
        elif not cause[level] or (named and kind in ('place', 'dependence')):
            # Those of a right name are right; what is learned of them holds where it is wrong.
            continue
        else:
            first = cause[level][0]['at' if level == 'place' else 'on']
            right = any(first in own[level == 'dependence'] for own in truths)
        sure = bool(cause['sure']) and (level == 'name' or kind == 'place of the rest')
        yield kind, said['features'], right, reported, sure


def _of_many(
    row: Mapping[str, Any], whole_right: bool
) -> Iterator[tuple[str, Mapping[str, float], bool, float, bool]]:
    """
    Yield the same of an arm that is off everywhere, of names and of kinds of many small errors.

    Every name is at work there: one is right if half of what it is said to do is there.
    """
    verdict, truth = row['verdict'], row['truth']
    there = [own for own in row['there'] if own is not None]
    foreign = bool(truth['excluded']) or any(e not in REGISTRY for e, _ in truth['sites'])
    for said in row['statements']:
        kind, level = said['kind'], said['kind'].split()[0]
        right, sure = whole_right, bool(verdict['sure'])
        if kind == 'nameless':
            right, sure = foreign and not any(own['name'] >= HALF for own in there), False
        elif kind != 'name' and not kind.endswith('many'):
            continue
        elif said['cause'] is not None:
            cause, part = verdict['causes'][said['cause']], row['there'][said['cause']]
            if part is None or not cause[level]:
                continue
            # Place and dependence of a right name are right.
            right = max(part['name'], part[level]) >= HALF
            sure = bool(cause['sure']) and level == 'name'
        yield kind, said['features'], right, said['probability'], sure


def complete(row: Mapping[str, Any]) -> bool:
    """
    Return whether no cause above the noise and a tenth of the squared gap is missing.

    row: as `trial.tried` gives it. What the plant calls otherwise than the library, such as lags that
    are equal in all joints, is there under the library's name.
    """
    truth, named = row['truth'], set[tuple[str, str | None]]()
    for cause in row['verdict']['causes']:
        if not cause['rest']:
            named |= {(n['effect'], n['joint']) for n in cause['name']}
    if any(answer and named.issuperset(answer) for answer in answers_of(truth)):
        return True
    gap = next(one['features']['gap'] for one in row['statements'] if one['kind'] == 'complete')
    least = max(1.0, LARGE * 10.0 ** (2.0 * gap))
    return not any(
        ratio**2 > least and not alike_by_structure(truth['robot'], (e, j)) & named
        for (e, j), ratio in zip(truth['sites'], truth['ratios'], strict=True)
    )

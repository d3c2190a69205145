# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A robot program corrected by a model file: what is read, what is changed, what is reported."""

import hashlib
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from weld_twin_core import __version__
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arm.rotation import rotation_vector
from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis.predicting.planned import Wanted, plan_more
from weld_twin_core.effects import Effect
from weld_twin_core.effects.dated import from_now_on
from weld_twin_core.errors import DataError, ModelError
from weld_twin_core.motion.programs.travel import repeated
from weld_twin_core.recording import JointMotion, Recording, checked_temperature
from weld_twin_core.twin.features import Features
from weld_twin_core.twin.program_correction import (
    SURE,
    Accuracy,
    Caps,
    ProgramCorrection,
    along_seams,
    conforms,
    correct_program,
    on_seams,
)
from weld_twin_core.twin.program_model import ProgramModel
from weld_twin_msgs_py.files.diagnosis_model import load_model, read_model
from weld_twin_msgs_py.files.posterior_entry import read_posterior
from weld_twin_msgs_py.programs import (
    Context,
    Program,
    check_written,
    read_sources,
    rewritten,
    to_moves,
)
from weld_twin_msgs_py.programs.languages import marked, refuse_marked
from weld_twin_msgs_py.programs.source import Source
from weld_twin_msgs_py.robots.urdf_tree import CORRECTED

from ..streams.supervision import Promise
from .exporting import without_limits
from .given_twin import build_twin, diagnosis_of, refuse_mended

SCHEMA = 'weld_twin/correction/1'
CORRECTED_ROBOT = (
    'the robot file holds the numbers of a diagnosis: points are moved for a controller that works with '
    'them; for one that works with the nominal ones give the nominal robot, and its diagnosis'
)
TOOL_LEFT = (
    'what was found of the tool was left out, for the program works with another tool than the '
    'one that was measured'
)
BASE_MOVED = (
    'the robot was found to stand elsewhere than its file says, and points are moved by that too; '
    'leave it out (diagnose with --align base) where the work frame was taught with this arm'
)
FRAMES_FITTED = (
    'frames were fitted to the recording ({frames}), and take up there what is off in the arm: the '
    'upper end of what is expected is for points that are given in the base of the robot; near the '
    'lower end only come points that were taught with this arm, where it was recorded'
)
IN_FULL = (
    'what counts from the point before ({places}) is written in full where its seam is corrected, with '
    'a remark of what it was: it goes along with that point no more'
)
NOT_SURE = (
    'how sure the correction is is not known: the model has no posterior, only a diagnosis.json '
    'written by this version has'
)


@dataclass(frozen=True, eq=False)
class CorrectedProgram:
    """A program, its correction, and the new texts."""

    program: Program
    texts: tuple[str, ...]  # one for every file of the program
    correction: ProgramCorrection
    notes: tuple[str, ...]  # what a reader should know, in sentences

    @property
    def accuracy(self) -> tuple[Accuracy | None, Accuracy | None]:
        """Return the expected accuracy before and after."""
        return along_seams(self.correction)


def program_model(
    robot: Robot, path: Path | str, temperature: float | None = None, setup: int = 0
) -> ProgramModel:
    """Return what a model file says acts on the arm of a program at a temperature [degC]."""
    if temperature is not None:
        checked_temperature(temperature)
    model = replace(arm_model(robot, path, setup), temperature=temperature)
    _refuse_by_effort(model.effects, path)
    return model


def arm_model(robot: Robot, path: Path | str, setup: int = 0) -> ProgramModel:
    """Return what a model file says acts on an arm from now on, in the middle of what is allowed."""
    content = diagnosis_of(path)
    if 'model' not in content and not content.get('unsound'):
        twin = build_twin(robot, path, mended=True)
        return ProgramModel(twin.robot, tuple(twin.effects))
    placed, model = load_model(robot, path, setup).robot, read_model(robot, path)
    result, posterior = from_now_on(model.found), read_posterior(robot, path)
    if posterior is not None:
        result, posterior = posterior.of_the_arm().centred(result, setup)
    changed = model.changed(setup)
    effects = (*from_now_on(model.known), *result, *changed)
    found = (*from_now_on(model.found), *changed)
    beside = frozenset(effect.name for effect in found if effect.traits.fitted_with)
    return ProgramModel(placed, effects, posterior, setup=setup, beside_frames=beside)


def _refuse_by_effort(effects: Sequence[Effect], path: Path | str) -> None:
    """Refuse springs that take measured efforts: nobody has measured those of a motion to come."""
    taking = [effect.site for effect in effects if effect.twin.by_effort]
    if taking:
        raise ModelError(
            f"the model '{path}' takes the measured effort of {taking[0]}, and a motion that is still "
            'to come has none; correct with a model that was diagnosed without --use-effort'
        )


def corrected_program(
    program: Program,
    context: Context,
    model: ProgramModel,
    caps: Caps | None = None,
    start: Array | None = None,  # shape (n,), joint positions before the first move
    readings: str = '',  # why the model counts joints otherwise, see `other_readings`
) -> CorrectedProgram:
    """Return a program corrected so that the real tool goes where it means."""
    name = program.sources[0].name
    refuse_marked(program.sources)
    if readings:
        where = [f'{p.where}: {p.name} holds' for p in program.points if p.value.ndim == 1]
        where += [] if start is None else ['--start holds']
        if where:
            raise DataError(
                f'{where[0]} joint values, and the model takes them otherwise: {readings}'
            )
    if not program.steps:
        raise DataError(f"no move was found in '{name}'; is its language {program.language}?")
    moves = to_moves(program, context.robot, context.controller)
    result = correct_program(
        model,
        moves,
        held=program.fixed,
        caps=caps,
        start=start,
        written=lambda points: _read_back(program, context, points)[1],
    )
    seams = {move.seam for piece in moves.pieces for move in piece}
    if seams <= set(result.left):
        raise DataError(
            f"nothing in '{name}' can be corrected: {next(iter(result.left.values()))}"
        )
    texts, _ = _read_back(program, context, result.program.points)
    notes = _notes(program, context, model) + [
        f'{where} names no posture; the only one that was recorded was taken'
        for where in result.travel.assumed
    ]
    notes += [f'corrected without play, friction and lag: {why}' for why in result.calm.values()]
    return CorrectedProgram(program, tuple(texts), result, tuple(notes))


def _read_back(
    program: Program, context: Context, points: Sequence[Array]
) -> tuple[list[str], list[Array]]:
    """Return the texts of a program with other points, and the points as they read there."""
    texts = rewritten(program, points, range(len(points)))
    sources = [
        source if text == source.text else marked(Source(source.name, text), program.language)
        for source, text in zip(program.sources, texts, strict=True)
    ]
    read = read_sources(sources, context, program.language)
    check_written(program, read, points)
    return [source.text for source in sources], [point.value for point in read.points]


def _notes(program: Program, context: Context, model: ProgramModel) -> list[str]:
    out = [*program.notes, *context.controller.notes, *_unused(program, context)]
    if places := [point.where for point in program.points if point.in_full]:
        out.append(IN_FULL.format(places=', '.join(places)))
    if CORRECTED in context.robot.source:
        out.append(CORRECTED_ROBOT)
    tools = [
        context.controller.tool(step.tool)
        for step in program.steps
        if step.end is not None and _has_tool(context, step.tool)
    ]
    fitted = model.posterior.directions.frames if model.posterior else ()
    errors = {effect.name for effect in model.effects if effect.traits.fitted_with not in fitted}
    errors |= model.beside_frames
    if 'tool_pose' in errors and not all(model.same_tool(tool) for tool in tools):
        out.append(TOOL_LEFT)
    if 'base_pose' in errors:
        out.append(BASE_MOVED)
    remaining = [e.name for e in model.effects if e not in model.acting]
    if remaining:
        out.append(f'no program mends {", ".join(remaining)}')
    if not model.acting:
        out.append('the model has nothing that a program could mend, and no point was moved')
    if model.posterior is None:
        out.append(NOT_SURE)
    elif fitted:
        out.append(FRAMES_FITTED.format(frames=', '.join(fitted)))
    return out


def _unused(program: Program, context: Context) -> list[str]:
    """Return which frames were given that no move names: a slip of the name, and they count nothing."""
    steps, controller = program.steps, context.controller
    out = []
    for what, given, used in (
        ('tool', controller.tools, {step.tool.name for step in steps}),
        ('base', controller.bases, {step.base.name for step in steps}),
    ):
        named = ', '.join(sorted(used - {''})) or 'none'
        out += [
            f'no move names the {what} {name!r} that was given, so it counts nothing; named are: {named}'
            for name in sorted(given.keys() - {each.lower() for each in used})
        ]
    return out


def other_causes(content: Mapping[str, Any]) -> list[str]:
    """Return that a promise holds for what a diagnosis names alone, where it could be another cause."""
    verdict = content.get('verdict') or {}
    same = verdict.get('same_on_any_motion') or []
    out = []
    for group in verdict.get('indistinguishable') or []:
        if len(group) > 1 and not any(all(site in one for site in group) for one in same):
            first, *others = (f'{s["effect"]} of {s["joint"] or "the robot"}' for s in group)
            out.append(
                f'what is expected holds if it is {first}; the recordings do not tell it from '
                f'{", ".join(others)}'
            )
    return out


def _has_tool(context: Context, tool: Any) -> bool:
    try:
        context.controller.tool(tool)
    except DataError:
        return False
    return True


def move_rows(made: CorrectedProgram) -> list[dict[str, Any]]:
    """Return for every move, in the order of the program, what happened to where it leads."""
    rows = []
    moves = [move for piece in made.correction.program.pieces for move in piece]
    for step, move, got in zip(made.program.steps, moves, made.correction.results, strict=True):
        point = None if move.end is None else made.program.points[move.end.point]
        rows.append(
            {
                'where': step.where,
                'kind': step.kind,
                'point': None if point is None else point.name,
                'declared': None if point is None else point.where,
                'seam': move.seam,
                'corrected': move.seam not in made.correction.left,
                'moved_m': got.length,
                'turned_rad': got.turn,
                'before_m': got.before,
                'after_m': got.after,
                'outside': got.outside,
                'sigma_m': got.sigma,
            }
        )
    return rows


def correction_entry(made: CorrectedProgram, robot: Robot, caps: Caps) -> dict[str, Any]:
    before, after = made.accuracy
    return {
        'schema': SCHEMA,
        'version': __version__,
        'robot': robot.name,
        'program': made.program.sources[0].name,
        'language': made.program.language,
        'max_correction': {'length_m': caps.length, 'turn_rad': caps.turn},
        'expected': {'before': _accuracy(before), 'after': _accuracy(after)},
        'moves': move_rows(made),
        'left': [{'seam': seam, 'why': why} for seam, why in sorted(made.correction.left.items())],
        'notes': [*made.notes, *without_limits(robot)],
    }


def way(made: CorrectedProgram, model: ProgramModel) -> list[dict[str, Any]]:
    """
    Return where the tool was meant to go and where it is commanded to instead, for `verifying`.

    For each stretch ``tool`` (``T_flange_tool``), and ``meant`` and ``commanded``: poses in the base
    frame of the model by position [m] and rotation vector [rad], one for one. Along corrected
    seams; at the ends of all moves where there are none.
    """
    out, every = [], on_seams(made.correction)
    seams = any(along.any() for along in every)
    for piece, along in zip(made.correction.travel.pieces, every, strict=True):
        motion = repeated(model.robot, made.correction.program, piece)
        meant, commanded = model.wanted(piece), model.wanted(piece._replace(motion=motion))
        for k, move in enumerate(piece.moves):
            chosen = piece.move == k
            if not seams:
                chosen = np.zeros(chosen.size, dtype=bool)
                chosen[piece.ends[k]] = True
            if move.seam in made.correction.left or (seams and not along[k]):
                continue
            poses = {'meant': _six(meant[chosen]), 'commanded': _six(commanded[chosen])}
            out.append({'tool': move.tool.tolist(), **poses})
    return out


def _six(poses: Array) -> list[list[float]]:
    """Return poses (N, 4, 4) as positions and rotation vectors, to a nanometre."""
    turns = [rotation_vector(pose[:3, :3]) for pose in poses]
    both = np.concatenate([poses[:, :3, 3], np.array(turns).reshape(-1, 3)], axis=1)
    return [[float(value) for value in row] for row in np.round(both, 9)]


def _accuracy(value: Accuracy | None) -> dict[str, Any] | None:
    if value is None:
        return None
    interval = None if value.low is None else [value.low, value.high]
    same = None if value.same is None else list(value.same)
    own = {'rms_m': value.rms, 'rms_ci90_m': interval, 'worst_m': value.worst}
    return own | {'rms_ci90_same_setup_m': same}


MORE = (5, 10, 20, 40)
"""Numbers of postures that are tried, fewest first: a measurement is no finer planned than that."""
OFFERED = 60
"""Postures along a program of which those to measure are chosen."""


def tolerance_entry(
    made: CorrectedProgram, model: ProgramModel, tolerance: float, noise: float
) -> dict[str, Any]:
    """
    Return how probably the tool keeps a tolerance [m] all along, before and after.

    noise: standard deviation of a measured coordinate, of postures measured in addition [m].
    """
    if not 0.0 < tolerance < 1.0:
        raise DataError(f'--tolerance must be above zero, got {tolerance * 1e3:g} mm')
    sides = {}
    for name, value in zip(('before', 'after'), made.accuracy, strict=True):
        if value is None or value.worsts is None:
            raise DataError('--tolerance needs a model that says how sure it is: a diagnosis.json')
        own, same = (_kept(value, tolerance, same_setup=same) for same in (False, True))
        sides[name] = {**own, 'same_setup': same}
    after, more = sides['after'], dict[bool, int]()
    if after['decision'] != 'kept':
        more = _postures_more(made, model, tolerance, noise)
    if after['same_setup']['decision'] != 'kept':
        after['same_setup']['postures_more'] = more.get(True)
    return {'tolerance_m': tolerance, **sides, 'postures_more': more.get(False)}


def _kept(value: Accuracy, tolerance: float, *, same_setup: bool) -> dict[str, Any]:
    """Return how probably a tolerance is kept, in the set-up that was recorded or in all."""
    probability = float(value.within(tolerance, same_setup=same_setup) or 0.0)
    return {
        'probability': probability,
        'decision': conforms(probability),
        'sure_within_m': value.likely_within(SURE, same_setup=same_setup),
    }


def _postures_more(
    made: CorrectedProgram, model: ProgramModel, tolerance: float, noise: float
) -> dict[bool, int]:
    """
    Return how many postures measured along the program make it sure.

    In the set-up that was recorded (True), and in all (False); without those where no number does.
    """
    assert model.posterior is not None
    q = np.concatenate([piece.motion.q for piece in made.correction.travel.pieces])
    postures = q[np.unique(np.linspace(0, len(q) - 1, min(OFFERED, len(q))).round().astype(int))]
    twin = model.twin(made.correction.travel.pieces[0].moves[0].tool)
    count = min(MORE[-1], len(postures))
    wanted, out = Wanted(tolerance, noise), dict[bool, int]()
    stations = plan_more(model.posterior, twin, (postures, postures), count, wanted).q
    for number in MORE:
        if number > len(stations):
            break
        t = np.arange(float(number))
        still = Recording('stations', JointMotion(t, stations[:number], static=True))
        surer = replace(
            model, posterior=model.posterior.after(Features(twin, still, t), noise), _twins={}
        )
        drawn = tuple(surer.drawn(look, look.motion) for look in made.correction.looks)
        _, after = along_seams(replace(made.correction, drawn=drawn))
        assert after is not None
        for same in (True, False):
            if (after.within(tolerance, same_setup=same) or 0.0) >= SURE:
                out.setdefault(same, number)
        if False in out:
            break
    return out


DIGITS = 12
"""Of the hash of a file, as it is reported: enough for all models of a plant."""


@dataclass(frozen=True, eq=False)
class LoadedModel:
    """A model and the file it came from."""

    path: Path
    digest: str  # of the content of the file
    read: ProgramModel
    promised: Promise | None  # how far measurements are from the twin that has the model
    modified: float  # when the file was written [s since 1970]

    def outdated(self, most_age: float = 0.0) -> str:
        """Return why the model is not fresh, or older than an age [s] above 0; else nothing."""
        try:
            now = self.path.stat().st_mtime
            changed = now != self.modified and _digest(self.path) != self.digest
        except OSError as error:
            return f"the model '{self.path}' cannot be read any more: {error.strerror}"
        if changed:
            return (
                f"the model '{self.path}' was exchanged; call ~/reload to go on with the new one"
            )
        age = time.time() - self.modified
        if most_age and age > most_age:
            return (
                f'the model is {age / 3600.0:.1f} hours old, at most {most_age / 3600.0:g} are '
                'allowed (max_model_age); measure and diagnose anew'
            )
        return ''

    def around(self, wrench: Array | None, frame: str, warm: float | None) -> ProgramModel:
        """Return what acts on the arm under a load [N, N m] and at a temperature [degC]."""
        return replace(self.read, wrench=wrench, wrench_frame=frame, temperature=warm, _twins={})


def loaded(robot: Robot, path: str) -> LoadedModel:
    if not path:
        raise ModelError("the compensator needs the parameter 'model': a diagnosis.json")
    file = Path(path)
    try:
        modified, digest = file.stat().st_mtime, _digest(file)
    except OSError as error:
        raise ModelError(f"the model '{path}' cannot be read: {error.strerror}") from None
    content = diagnosis_of(file)
    refuse_mended(content, file)
    read = program_model(robot, file)
    return LoadedModel(file, digest, read, _promised(content, read), modified)


def _promised(content: dict[str, Any], read: ProgramModel) -> Promise | None:
    """Return what a model leaves on unseen data; None where its file does not say so."""
    remaining = _number(content, 'shrink', 'rms_after_m')
    if not remaining:
        return None
    unsure = 0.0 if read.posterior is None else read.posterior.recorded_m
    return Promise.of(remaining, unsure, max(int(_number(content, 'gap', 'samples')), 1))


def _number(content: dict[str, Any], part: str, key: str) -> float:
    values = content.get(part)
    value = values.get(key) if isinstance(values, dict) else None
    return float(value) if isinstance(value, int | float) else 0.0


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()[:DIGITS]

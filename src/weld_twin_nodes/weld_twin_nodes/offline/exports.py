# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The model of a diagnosis as robots, planners and people load it, and where it holds, in sentences."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from weld_twin_core.arm.known_arms import fingerprint
from weld_twin_core.arm.robot import Robot
from weld_twin_core.diagnosis.algebra.problem import Alone, Model
from weld_twin_core.effects import Effect, JointOffset
from weld_twin_core.effects.dated import of_the_robot
from weld_twin_core.effects.wording import TURNED_ROUND, stands, to_mend
from weld_twin_core.twin.compensation import corrected, joint_offsets
from weld_twin_core.twin.posterior import Posterior
from weld_twin_msgs_py.files.csv_text import csv_text
from weld_twin_msgs_py.files.effects_file import head_of
from weld_twin_msgs_py.files.whole_files import write_text
from weld_twin_msgs_py.files.yaml_file import yaml_text
from weld_twin_msgs_py.robots import write_robot_yaml, write_urdf
from weld_twin_msgs_py.robots.urdf_tree import CORRECTED
from weld_twin_msgs_py.robots.urdf_write import GivenUrdf, write_urdf_like

AS_GOOD = 1.1
"""Ratio of what a robot file leaves to what the whole model leaves up to which either may be taken: less
is a matter of the stretches left out."""
NOTHING_KNOWN = 3e-3
"""Spread [m] from which a model knows nothing of a place: an arm as delivered is off by no more."""
_BESIDES = 'noise and what no parameter explains come on top'


def where_it_holds(posterior: Posterior) -> list[str]:
    """Return how far a model can be relied on, what was left open, and where it was measured."""
    recorded, anywhere = (
        f'{v * 1e3:.2g} mm' for v in (posterior.recorded_m, posterior.anywhere_m)
    )
    out = [
        f'The whole model is known to {recorded} where it was measured (one standard deviation), and '
        f'nothing is known of elsewhere in its reach: the postures are too alike; {_BESIDES}.'
        if posterior.anywhere_m > NOTHING_KNOWN
        else f'The whole model is known to {recorded} where it was measured, but only to {anywhere} '
        f'elsewhere in its reach (one standard deviation each); {_BESIDES}.'
        if anywhere != recorded
        else f'The whole model is known to {recorded} (one standard deviation); {_BESIDES}.'
    ]
    out += undetermined(posterior)
    return [*out, 'Measured at ' + '; '.join(posterior.domain.sentences()) + '.']


def elsewhere(posterior: Posterior, corrected: bool) -> str:
    """Return that what is said holds where it was measured, and how wide it is beyond."""
    if not corrected:
        return 'All this holds where it was measured, and says nothing of elsewhere in its reach.'
    if posterior.region is not None:
        region, sigma = posterior.region
        return (
            f"In the region '{region}' the corrected robot may still be off by {sigma * 1e3:.2g} mm "
            '(one standard deviation); weld-twin investigate --tolerance MM --model diagnosis.json '
            '--region says what to measure there.'
        )
    if posterior.anywhere_m > NOTHING_KNOWN:
        return (
            'All this holds where it was measured. Of elsewhere in its reach these recordings tell '
            'nothing: the postures are too alike. Measure there before you weld there.'
        )
    return (
        'All this holds where it was measured. Elsewhere in its reach the corrected robot may still '
        f'be off by {posterior.anywhere_m * 1e3:.2g} mm (one standard deviation): measure there '
        'before you weld there.'
    )


def file_alone(alone: Alone, *, left: bool) -> list[str]:
    """Return what a robot file leaves beside the whole model, in sentences for its head."""
    by_itself = (
        f'{_mm(alone.recorded_m)} where it was recorded and {_mm(alone.unseen_m)} on data that were '
        'not fitted'
    )
    if not left:
        return [f'This file holds all that was found of the robot, and leaves {by_itself} (RMS).']
    out = [
        f'This file alone leaves {by_itself} (RMS). The whole model (diagnosis.json, or this file '
        f'with robot_effects.yaml) leaves {_mm(alone.whole_recorded_m)} and '
        f'{_mm(alone.whole_unseen_m)}.'
    ]
    if alone.changes:
        out.append(
            'Its constants were fitted once more for use without the effects that it cannot hold, '
            'and are not those of the page; robot_effects.yaml takes the difference back.'
        )
    return out


def which_file(alone: Alone | None) -> str:
    """Return which file to take, in a sentence; nothing where all do as well, or it is not known."""
    if alone is None or alone.unseen_m < AS_GOOD * alone.whole_unseen_m:
        return ''
    return (
        'Take diagnosis.json (weld-twin correct): it leaves '
        f'{_mm(alone.whole_unseen_m)} on data that were not fitted. robot.yaml and robot.urdf '
        f'cannot hold all that was found, and leave {_mm(alone.unseen_m)} by themselves.'
    )


def _mm(length: float) -> str:
    return f'{length * 1e3:.3f} mm'


def undetermined(posterior: Posterior) -> list[str]:
    """Return the directions that the recordings left open, in one sentence or none."""
    if not posterior.left_open:
        return []
    count = len(posterior.left_open)
    named = 'direction of the frames is' if count == 1 else 'directions of the frames are'
    return [
        f'{count} {named} left open by the recordings, and as given as far as the data bear that: '
        f'{"; ".join(posterior.left_open)}.'
    ]


_OF_ITSELF = f'This robot is {CORRECTED}.'
_EVERYTHING = 'Every effect of the twin; goes with the nominal robot.'
_LEFT_OVER = 'What the corrected robot.yaml cannot hold; goes with that, not with the nominal.'


def write_yaml(path: Path, model: Model, notes: Sequence[str]) -> None:
    """Write the corrected robot as a robot file."""
    said = _of_the_robot(model, notes)
    write_robot_yaml(path, _corrected(model)[0], notes=said, overwrite=True)


def write_model_urdf(path: Path, model: Model, notes: Sequence[str]) -> None:
    """Write the corrected robot as a URDF."""
    said = [_OF_ITSELF, *_of_the_robot(model, notes)]
    write_urdf(path, _corrected(model)[0], overwrite=True, notes=said)


def write_offsets(path: Path, model: Model, notes: Sequence[str]) -> None:
    """
    Write how much further each joint really stands than its reading: rad and deg, or m and mm.

    Only zeros that are named are to be set: others that a model has beside them may stand
    against its springs and lengths, and do harm without them.
    """
    del notes
    robot = model.robot
    named = [e for e in model.found if model.named is None or (e.name, e.site) in model.named]
    offsets = joint_offsets(robot, of_the_robot((*model.known, *named))) + _zeros(model)
    turned, rows = model.turned, []
    for name, offset, slides in zip(robot.joint_names, offsets, robot.prismatic, strict=True):
        shown = offset * 1e3 if slides else np.degrees(offset)
        units = ('m', 'mm') if slides else ('rad', 'deg')
        said = f'{stands(name, offset, sliding=slides)} {to_mend(offset, sliding=slides)}'
        if name in turned:
            said += f' {TURNED_ROUND}'
        meaning = said if offset else ''
        rows.append((name, float(offset), units[0], f'{shown:.6f}', units[1], meaning))
    remarks = ''.join(f'# {line}\n' for line in _readings(model))
    table = csv_text(('joint', 'offset', 'unit', 'shown', 'shown_unit', 'meaning'), rows)
    write_text(path, remarks + table, overwrite=True)


def write_effects(path: Path, model: Model, notes: Sequence[str]) -> None:
    """Write every effect, known and found, for use with the nominal robot."""
    pair = _pair(model, corrected=False)
    head = [_EVERYTHING, *pair, *_mended(model), *notes]
    _write_effects(path, head, _lasting(model))


def write_left_over(path: Path, model: Model, notes: Sequence[str]) -> None:
    """Write the effects that the corrected robot cannot hold."""
    robot, remaining = _corrected(model)
    changed = fingerprint(robot) != fingerprint(model.robot)
    pair = _pair(model, corrected=True) if changed else []
    head = [_LEFT_OVER, *pair, *_readings(model), *notes]
    _write_effects(path, head, remaining)


FORMATS: dict[str, tuple[str, Callable[[Path, Model, Sequence[str]], None]]] = {
    'yaml': ('robot.yaml', write_yaml),
    'urdf': ('robot.urdf', write_model_urdf),
    'offsets': ('joint_offsets.csv', write_offsets),
    'effects': ('effects.yaml', write_effects),
    'left-over': ('robot_effects.yaml', write_left_over),
}
"""What the command line calls a form, its usual file name, and how it is written."""


def write_all(
    directory: Path, model: Model, notes: Sequence[str] = (), given: GivenUrdf | None = None
) -> None:
    """Write the model in every form; the URDF that was given lends names to the corrected one."""
    for name, write in FORMATS.values():
        write(directory / name, model, notes)
    if given is not None:
        write_given_urdf(directory / FORMATS['urdf'][0], model, notes, given)


def write_given_urdf(path: Path, model: Model, notes: Sequence[str], given: GivenUrdf) -> None:
    """Write the corrected robot as the URDF that it was read from, its names kept."""
    robot, said = _corrected(model)[0], [_OF_ITSELF, *_of_the_robot(model, notes)]
    write_urdf_like(path, given, robot, overwrite=True, notes=said)


def _of_the_robot(model: Model, notes: Sequence[str]) -> list[str]:
    """Return the head of a robot file: what it leaves by itself, and where the model holds."""
    own = [] if model.alone is None else file_alone(model.alone, left=bool(_corrected(model)[1]))
    return [*own, *_readings(model), *notes]


def _corrected(model: Model) -> tuple[Robot, tuple[Effect, ...]]:
    based = model.robot.with_frames(base=model.bases[0])
    zeros = _zeros(model)
    keyed = [JointOffset(name, zero) for name, zero in zip(based.joint_names, zeros, strict=True)]
    robot, remaining = corrected(based, (*_lasting(model), *_changes(model), *keyed))
    # What the file has for use by itself, the effects that go with it take back.
    remaining = (*remaining, *(effect.with_vector(-effect.vector()) for effect in _changes(model)))
    source = f'{robot.source}; {CORRECTED}' if robot.source else CORRECTED
    if model.mended:
        source += f' of mended data: {" ".join(model.mended)}'
    lower, upper = robot.lower - zeros, robot.upper - zeros
    return replace(robot, source=source, lower=lower, upper=upper), remaining


def _pair(model: Model, *, corrected: bool) -> list[str]:
    """Return with which robot an effects file goes; nothing where mending changed what was given."""
    return [] if model.mends else [head_of(model.robot, corrected=corrected)]


def _changes(model: Model) -> tuple[Effect, ...]:
    """Return what the robot file has beside the constants found, to do well by itself."""
    return () if model.alone is None else model.alone.changes


def _zeros(model: Model) -> np.ndarray:
    """
    Return what was added to the readings before the diagnosis, shape (n,) [rad or m].

    A zero is the arm's or its controller's, so files take readings as they were recorded. Columns,
    signs and units that were mixed up belong to the recording alone.
    """
    matrix, offset = model.reading_map()
    return offset if np.array_equal(matrix, np.eye(model.robot.n)) else np.zeros(model.robot.n)


def _readings(model: Model) -> list[str]:
    """Return what was mended, and which readings the files take."""
    notes = _mended(model)
    if not any(mend.get('do') == 'joints' for mend in model.mends):
        return notes
    if _zeros(model).any():
        return [
            *notes,
            'That is in the numbers below: they take the readings as they were recorded.',
        ]
    return [*notes, 'The numbers below take readings in which that is mended.']


def _lasting(model: Model) -> tuple[Effect, ...]:
    """Return what robot and cell have, curves too; how a set-up moved is of no use elsewhere."""
    return of_the_robot(model.known + model.found)


def _write_effects(path: Path, notes: Sequence[str], effects: Sequence[Effect]) -> None:
    entries = [effect.to_mapping() for effect in effects]
    comment = ''.join(f'# {note}\n' for note in notes)
    write_text(path, comment + yaml_text(entries), overwrite=True)


def _mended(model: Model) -> list[str]:
    return [f'Mended before the diagnosis: {sentence}' for sentence in model.mended]

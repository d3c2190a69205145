# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Does a corrected program help? Out, in by another reader, run by another arm.

The plant records an arm with sealed causes, in free motion and along the seam as its program has it;
both are diagnosed; the program is corrected with the diagnosis file, as a user does it. Beside it it is
corrected by asking the plant itself, which knows the true causes. A reader that shares nothing with
the product takes each program in, a plain controller that knows no error interpolates it, and the
plant runs it. The path is judged against the seam as the program meant it.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from operator import itemgetter
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from weld_twin_core.arm.chain import forward
from weld_twin_core.arm.rotation import angle_between, rotation_matrix
from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis import Diagnosis, diagnose
from weld_twin_core.effects import REGISTRY, effects_from_list
from weld_twin_core.effects.effect import MemoryEffect
from weld_twin_core.errors import DataError, TwinError
from weld_twin_core.metrics.iso9283 import nearest_pass
from weld_twin_core.motion.programs import Piece
from weld_twin_core.recording import JointMotion
from weld_twin_core.twin.program_model import ProgramModel
from weld_twin_msgs_py.files import markdown
from weld_twin_msgs_py.files.whole_files import write_text
from weld_twin_msgs_py.programs import read_sources
from weld_twin_msgs_py.programs.source import Source
from weld_twin_nodes.offline.correcting import CorrectedProgram, corrected_program, program_model
from weld_twin_nodes.offline.task_pool import Task
from weld_twin_report.report.diagnosis_files import RESULT, diagnosis_text

from ..blind.blind_cell import RATE
from ..blind.cause_sizes import site
from ..blind.scoring import in_words
from ..study import Study, engine_digest, head, require_simulator, shown, tabled
from .plain import REST, Driven, driven, evenly, tool_pose
from .sealed_seams import CELLS, MEASURING, SealedSeam, drawn_as, reader_of, sealed_seam

APART = 1e-3
"""Places of the command path are looked at so far apart [m]: what turns around takes a few of them."""


class PathAccuracy(NamedTuple):
    """How far a tool was from a path [m]."""

    at: float
    """AT_p of ISO 9283, clause 8.2: the largest distance, over the points of the command path, of
    where the tool passes the plane square to it. The plant repeats itself exactly, so one cycle is
    the barycentre of ten."""
    rms: float
    """Of the same distances."""


def path_accuracy(attained: np.ndarray, wanted: np.ndarray) -> PathAccuracy:
    """
    Return how far a tool was from a path.

    attained: shape (K, 3) [m].
    wanted: the command path, shape (m, 3) [m]. At its ends, where the tool may not pass the plane,
    the distance to the nearest place of the tool counts.
    """
    fine = _finely(wanted)
    off = []
    for centre, tangent in zip(fine, np.gradient(fine, axis=0), strict=True):
        passed = nearest_pass(attained, centre, tangent)
        nearest = float(np.linalg.norm(attained - centre, axis=1).min())
        off.append(nearest if passed is None else float(np.linalg.norm(passed - centre)))
    return PathAccuracy(max(off), float(np.sqrt(np.mean(np.square(off)))))


def _finely(path: np.ndarray) -> np.ndarray:
    """Return places along straight pieces, shape (m, 3)."""
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    at = np.linspace(0.0, way[-1], max(int(np.ceil(way[-1] / APART)), 1) + 1)
    return np.stack([np.interp(at, way, column) for column in path.T], axis=1)


MEMORY = frozenset(
    {name for name, kind in REGISTRY.items() if issubclass(kind, MemoryEffect)} | {'loaded_play'}
)
"""Causes whose effect hangs on where the arm came from."""
UNCHANGED = 'nothing was found that a program mends'


@dataclass(frozen=True, eq=False)
class AskedModel(ProgramModel):
    """A model that is no model: where the real tool goes, the plant is asked."""

    seam: SealedSeam | None = None
    without: frozenset[str] = MEASURING

    def without_memory(self) -> AskedModel:
        return replace(self, without=self.without | MEMORY)

    def real(self, piece: Piece, motion: JointMotion, *, whole: bool = True) -> Array:
        """
        Return ``T_base_tool`` of the plant, always whole, at every sample of a motion, (N, 4, 4).

        What is off is looked up between the plant's samples; it changes slowly, the tool does not.
        """
        del whole
        assert self.seam is not None
        even = np.arange(motion.t[0], motion.t[-1] + 4.0 / RATE, 1.0 / RATE)
        q = np.stack([np.interp(even, motion.t, column) for column in motion.q.T], axis=1)
        made = self.seam.ran(even, q, self.without)
        meant = forward(self.robot, q)
        turned = Rotation.from_quat(made.quaternion).as_matrix()
        off = np.concatenate(
            [made.position - meant[:, :3, 3], angle_between(turned, meant[:, :3, :3])], axis=1
        )
        there = np.stack([np.interp(motion.t, even, column) for column in off.T], axis=1)
        out = forward(self.robot, motion.q)
        out[:, :3, 3] += there[:, :3]
        out[:, :3, :3] = rotation_matrix(there[:, 3:]) @ out[:, :3, :3]
        return np.asarray(np.linalg.inv(self.robot.T_world_base) @ out)


def corrected_seam(language: str, seed: int, number: int) -> dict[str, Any]:
    """Return what a correction does to one seam; a case that cannot be drawn says why."""
    try:
        seam = sealed_seam(language, seed, number)
    except TwinError as error:
        return {'language': language, 'undrawn': str(error)}
    along = seam_driven(seam, seam.text)
    known = effects_from_list(list(seam.cell.known), seam.robot)
    diagnosis = diagnose(seam.recordings(along, seed), seam.robot, known=known)
    outcome = promised_and_true(seam, along, diagnosis)
    after = outcome.pop('text')
    asked = AskedModel(seam.robot, (), temperature=seam.temperature, seam=seam)
    _, best, limit = _or_as_it_was(seam, asked)
    texts = {'before': seam.text, 'after': after, 'true': best}
    accuracy = {name: _accuracy(seam, text, along) for name, text in texts.items()}
    return {
        **drawn_as(seam),
        'status': diagnosis.status,
        **outcome,
        'limit': limit,
        'at_m': {name: one.at for name, one in accuracy.items()},
        'rms_m': {name: one.rms for name, one in accuracy.items()},
    }


def promised_and_true(seam: SealedSeam, along: Driven, diagnosis: Diagnosis) -> dict[str, Any]:
    """Return what a diagnosis makes of a seam, what it promises before and after, and what is true."""
    text, outcome, why, promised = _by_diagnosis(seam, diagnosis)
    off = {'before': _off(seam, seam.text, along), 'after': _off(seam, text, along)}
    return {'text': text, 'outcome': outcome, 'why': why, 'off_m': off, 'promised': promised}


def seam_driven(seam: SealedSeam, text: str) -> Driven:
    """Return what the plain controller makes of a program, read by the independent reader."""
    moves = reader_of(seam.language, seam.robot)([text])
    return driven(seam.robot, moves, seam.start, seam.speed)


def _accuracy(seam: SealedSeam, text: str, wanted: Driven) -> Any:
    base = np.array(seam.robot.T_world_base)
    real = seam.ran(*evenly(seam_driven(seam, text), RATE)).position
    return path_accuracy(real, wanted.tool @ base[:3, :3].T + base[:3, 3])


def _off(seam: SealedSeam, text: str, meant: Driven) -> tuple[float, float]:
    """
    Return RMS and largest distance of the plant's tool from where the program means it then [m].

    That is where the controller believes it, less what the points around were moved by: what a
    promise is of, and what `verify` measures.
    """
    along, base = seam_driven(seam, text), np.array(seam.robot.T_world_base)
    t, q = evenly(along, RATE)
    keep = (t >= REST) & (t <= REST + along.clock[-1])
    at = t[keep] - REST
    moved = along.believed(along.ends) - meant.believed(meant.ends)
    # Points are moved, and what lies between them by its share of the way.
    ends = np.interp(along.ends, along.clock, along.way)
    moved = np.stack([np.interp(along.way, ends, by) for by in moved.T], axis=1)
    # Between the places it works out, a controller turns its joints evenly: the tool goes in a bow.
    tool = np.array(seam.robot.T_flange_tool)
    believed = tool_pose(seam.robot, q[keep], tool)[:, :3, 3]
    wanted = believed - np.stack([np.interp(at, along.clock, by) for by in moved.T], axis=1)
    real = (seam.ran(t, q).position[keep] - base[:3, 3]) @ base[:3, :3]
    off = np.linalg.norm(real - wanted, axis=1)
    # What is promised is of the way, and not of the time that it takes.
    way = np.gradient(np.interp(at, along.clock, along.way))
    return float(np.sqrt(np.average(off**2, weights=way))), float(off.max())


def _by_diagnosis(
    seam: SealedSeam, diagnosis: Diagnosis
) -> tuple[str, str, str, dict[str, Any] | None]:
    """Return the program corrected with a diagnosis file, what became of it, why, and its promise."""
    with TemporaryDirectory() as place:
        file = Path(place) / RESULT
        write_text(file, diagnosis_text(diagnosis, ()))
        try:
            model = program_model(seam.robot, file, seam.temperature)
        except TwinError as error:
            return seam.text, 'refused', str(error).replace(place, ''), None
    made, text, why = _or_as_it_was(seam, model)
    return text, 'left' if why else 'corrected', why, None if made is None else _promised(made)


def _promised(made: CorrectedProgram) -> dict[str, Any]:
    return {
        name: {'ci90_m': [accuracy.low, accuracy.high], 'sure_within_m': accuracy.sure_within}
        for name, accuracy in zip(('before', 'after'), made.accuracy, strict=True)
        if accuracy is not None and accuracy.low is not None
    }


def _or_as_it_was(
    seam: SealedSeam, model: ProgramModel
) -> tuple[CorrectedProgram | None, str, str]:
    """Return the program corrected by a model, with its text; as it was where it is left, and why."""
    name = f'seam{CELLS[seam.language].suffix}'
    program = read_sources([Source(name, seam.text)], seam.context, seam.language)
    try:
        made = corrected_program(program, seam.context, model)
    except DataError as error:
        return None, seam.text, str(error)
    return made, made.texts[0], '' if made.texts[0] != seam.text else UNCHANGED


NOISE = 1e-6
"""Change of a path's accuracy [m] that is none: programs are written to about a micrometre."""
OUTCOMES = ('corrected', 'left', 'refused')


def worse(entry: dict[str, Any]) -> bool:
    """Tell whether a program's path is worse than before by more than programs are written to."""
    at = entry['at_m']
    return bool(at['after'] > at['before'] + NOISE)


def ratio(entry: dict[str, Any], what: str = 'after') -> float:
    """Return an accuracy over that with the true causes; a seam left as it was is before."""
    at = entry['at_m']
    return float(at[what] / at['true'])


def counted(cases: Sequence[dict[str, Any]]) -> dict[str, Any]:
    drawn = [case for case in cases if 'undrawn' not in case]
    outcomes = Counter(case['outcome'] for case in drawn)
    out: dict[str, Any] = {'cases': len(drawn), 'undrawn': len(cases) - len(drawn)}
    out |= {name: outcomes[name] for name in OUTCOMES}
    out['worse'] = sum(worse(case) for case in drawn)
    if drawn:
        ratios = [ratio(case) for case in drawn]
        corrected = [ratio(case) for case in drawn if case['outcome'] == 'corrected']
        out |= {
            'at_m': {
                name: float(np.median([case['at_m'][name] for case in drawn]))
                for name in ('before', 'after', 'true')
            },
            'ratio': _spread(ratios),
            'ratio_of_corrected': _spread(corrected) if corrected else None,
            'ratio_before': float(np.median([ratio(case, 'before') for case in drawn])),
        }
    return out


def _spread(values: Sequence[float]) -> dict[str, float]:
    return {
        'median': float(np.median(values)),
        'p90': float(np.percentile(values, 90.0)),
        'worst': float(max(values)),
    }


def totals(cases: Sequence[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    languages = list(dict.fromkeys(case['language'] for case in cases))
    out = {one: counted([c for c in cases if c['language'] == one]) for one in languages}
    return {**out, 'all': counted(cases)}


def page(result: dict[str, Any]) -> str:
    rows = [item for item in result['totals'].items() if item[1]['cases']]
    drawn = [case for case in result['cases'] if 'undrawn' not in case]
    why = Counter(_plain(case['why']) for case in drawn if case['why'])
    return '\n'.join(
        [
            '## Corrected seams, run by the plant',
            '',
            f'Seed {result["seed"]}. AT is the path accuracy of ISO 9283; where no number of',
            'a language is told apart it is the median of its seams.',
            '',
            tabled(LANGUAGES, rows),
            '',
            '## Why seams were left as they were',
            '',
            markdown.table(('why', 'seams'), *((text, str(n)) for text, n in why.most_common())),
            '',
            '## Every seam',
            '',
            tabled(SEAMS, drawn),
            '',
        ]
    )


def _plain(why: str) -> str:
    """Return a reason without its place and numbers."""
    return re.sub(r'\d+\.\d+', '...', why.rpartition(': ')[2])


def _accuracies(*at: Any) -> dict[str, Callable[[Any], str]]:
    """Return the columns of path accuracies [mm], which stand in a row at some keys."""
    keys = {'AT before, mm': 'before', 'after': 'after', 'true causes': 'true'}
    return {head: shown(*at, key, by='{:.3f}', times=1e3) for head, key in keys.items()}


LANGUAGES: dict[str, Callable[[Any], object]] = {
    'language': lambda row: row[0],
    'cases': lambda row: row[1]['cases'],
    'corrected': lambda row: row[1]['corrected'],
    'left': lambda row: row[1]['left'],
    'refused': lambda row: row[1]['refused'],
    **_accuracies(1, 'at_m'),
    'after over true, median': shown(1, 'ratio', 'median', by='{:.2f}'),
    '90 of 100': shown(1, 'ratio', 'p90', by='{:.2f}'),
    'worst': shown(1, 'ratio', 'worst', by='{:.2f}'),
    'before over true, median': shown(1, 'ratio_before', by='{:.2f}'),
    'worse than before': lambda row: row[1]['worse'],
}
"""Columns of the table of languages, each a name and its totals."""
SEAMS: dict[str, Callable[[Any], object]] = {
    'language': itemgetter('language'),
    'robot': itemgetter('robot'),
    'causes': lambda case: in_words(map(site, case['causes']), ', '),
    'seam': itemgetter('seam'),
    'verdict': itemgetter('status'),
    'outcome': lambda case: case['outcome'] + (', worse than before' if worse(case) else ''),
    **_accuracies('at_m'),
    'over true': lambda case: f'{ratio(case):.2f}',
}
"""Columns of the table of seams."""


def run(study: Study) -> None:
    require_simulator()
    seed = study.args.seed
    tasks = [
        Task(corrected_seam, (language, seed, k), f'{language} {k}')
        for language in CELLS
        for k in range(study.args.seams)
    ]
    cases = study.tasks(tasks, 'corrections')
    results = {'engine': engine_digest(), 'seed': seed, 'totals': totals(cases), 'cases': cases}
    study.write('corrections', head('programs/1', **results), page(results))

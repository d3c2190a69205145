# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Say where the gap lies, what causes it, how far it shrinks."""

import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from math import ceil
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.markup import escape

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.contacts import Contacts
from weld_twin_core.diagnosis import Diagnosis, diagnose
from weld_twin_core.diagnosis.advice import Limits
from weld_twin_core.diagnosis.advice.postures import USUAL_MINUTES
from weld_twin_core.diagnosis.algebra.problem import frames_named
from weld_twin_core.diagnosis.frames.changes import families_named
from weld_twin_core.errors import DataError, ModelError
from weld_twin_core.recording import Recording
from weld_twin_msgs_py.files.artefact_file import read_artefact
from weld_twin_msgs_py.files.input_files import InputFile
from weld_twin_nodes.cli.given import (
    PAGE,
    Given,
    inputs_of,
    refuse_changed,
    refuse_unknown_effect,
    twin_of,
)
from weld_twin_nodes.offline.exporting import without_limits
from weld_twin_nodes.offline.set_up_changes import set_up_change, with_changes

from ...report import print_summary
from ...report.diagnosis_files import PDF, RESULT, browser, print_page, write_results
from ...report.diagnosis_page import Sheet, joint_labels
from ...report.sections import Demand

LINES = 'WELD_TWIN_PROGRESS'
"""Variable of the environment: 'lines' writes every step as a line to stderr."""
TABLES = ('.csv', '.tsv', '.txt', '.dat', '.dg')
"""Endings of files that are tables of text, read as `weld-twin import` reads them."""
UNSOUND = 3
"""Exit code where data or set-up are wrong."""
MEASUREMENTS = 40_000
"""Diagnosed together; eleven minutes at 60 Hz."""
JOINT_STATES = 150_000
"""The same; twenty minutes at 125 Hz."""


def _metres(value: float | None, option: str) -> float | None:
    if value is not None and not 0.0 < value < 1000.0:
        raise ModelError(f'{option} {value:g}: give millimetres above 0 and below 1000')
    return None if value is None else 1e-3 * value


def run(given: Given) -> int:
    """Diagnose, write the results, print the verdict."""
    if given.pdf:
        browser()
    labels = (
        joint_labels(given.joint_names, given.load_robot().joint_names)
        if given.joint_names
        else {}
    )
    sizes = [_metres(getattr(given, name), f'--{name}') for name in ('tolerance', 'uncertainty')]
    sheet = Sheet(Demand(*sizes), labels, given.controller)
    with given.output(RESULT) as place:
        inputs = inputs_of(
            recording=given.bag,
            held_out=given.holdout,
            robot=given.robot,
            effects_known=given.effects_known,
        )
        diagnosis = _diagnosis(given, inputs)
        write_results(place, diagnosis, inputs, given.find_urdf(), sheet)
        if given.pdf:
            print_page(place / PAGE, place / PDF)
    console = Console(highlight=False)
    print_summary(diagnosis, console, sheet.demand)
    if (diagnosis.next_experiment or {}).get('motion'):
        for note in without_limits(diagnosis.model.robot):
            console.print(f'note: {note}', markup=False)
    console.print(f'report: {Path(given.out) / PAGE}', markup=False)
    return UNSOUND if diagnosis.status == 'unsound' else 0


def _diagnosis(given: Given, inputs: Sequence[InputFile]) -> Diagnosis:
    from weld_twin_nodes.offline.region import region

    align = frames_named(given.align, '--align')
    for name in given.exclude_effect:
        refuse_unknown_effect('--exclude-effect', name)
    changing = families_named(given.may_change, '--may-change')
    if changing and len(given.bag) < 2:
        raise ModelError('--may-change compares recordings; give two or more bags of one arm')
    changes = {}  # by the place of the bag
    for bag, what in given.changed:
        if bag not in given.bag:
            raise DataError(f"--changed: '{bag}' is none of the recordings")
        changes[given.bag.index(bag)] = set_up_change(what)
    twin = twin_of(given.load_robot(), given.effects_known)
    judged = region(twin.robot, given.region)[0] if given.region else None
    with _progress() as tell:
        recordings = _read(given, twin.robot, 'base' in align, tell)
        refuse_changed(inputs)
        count = len(given.bag)
        fitted, more = with_changes(_bounded(recordings[:count]), changes, twin.robot)
        result = diagnose(
            fitted,
            twin.robot,
            align=align,
            known=twin.effects,
            exclude=tuple(given.exclude_effect),
            holdout=_bounded(recordings[count:]),
            apply=given.apply,
            may_change=tuple(dict.fromkeys([*changing, *more])),
            limits=_limits(given),
            progress=tell,
        )
    return result if judged is None else _in_region(result, given.region, judged)


def _read(
    given: Given, robot: Robot, own_frame: bool, tell: Callable[[str], None]
) -> list[Recording]:
    """Return all recordings, with artefact and instrument as given."""
    from weld_twin_msgs_py.files.instruments import instrument, measured_by

    what = instrument(given.instrument) if given.instrument else None
    out: list[Recording] = []
    for path in (*given.bag, *given.holdout):
        tell(f'reading {path}')
        if Path(path).suffix.lower() in TABLES:
            result, _ = given.read_table(robot, path)  # what was assumed is in its notes
        else:
            # Two clocks are for the checks of the data to name.
            result = given.read_bag(path, robot, one_clock=False, needs_measurements=True)
            result = _described(result, given.contacts)
        out.append(result if what is None else measured_by(result, what, own_frame=own_frame))
    return out


def _in_region(result: Diagnosis, region: str, judged: Array) -> Diagnosis:
    """Return the diagnosis with what to expect in a region that was asked for."""
    from weld_twin_core.diagnosis.predicting.allowed import corrected_sigma

    if result.posterior is None:
        return result
    sigma = corrected_sigma(result.posterior, result.model, judged)
    return replace(result, posterior=replace(result.posterior, region=(region, sigma)))


def _limits(given: Given) -> Limits:
    """Return what the next experiment may cost, and where it has to stay."""
    minutes = USUAL_MINUTES if given.experiment_minutes is None else given.experiment_minutes
    limits = Limits(minutes, confirm=given.confirm)
    if not given.cell_box:
        return limits
    try:
        numbers = [float(part) for part in given.cell_box.split(',')]
    except ValueError:
        numbers = []
    if len(numbers) != 6:
        raise DataError(f"--cell-box takes six numbers with commas, got '{given.cell_box}'")
    return replace(limits, box=np.array(numbers).reshape(2, 3))


def _described(recording: Recording, artefact: str) -> Recording:
    """Return the recording with its contacts as an artefact file describes them."""
    contacts = recording.contacts
    if not artefact or contacts is None:
        return recording
    touched = Contacts(read_artefact(artefact), contacts.labels, contacts.value, contacts.sigma)
    return replace(recording, contacts=touched)


def _bounded(recordings: Sequence[Recording]) -> list[Recording]:
    """Return the recordings, together within what memory allows; each says what was left out."""
    moving = [r for r in recordings if r.measured is not None and not r.joints.static]
    measured = sum(r.measured.t.size for r in moving if r.measured is not None)
    states = sum(r.joints.t.size for r in moving)
    return [
        r.thinned(
            _share(0 if r.measured is None else r.measured.t.size, measured, MEASUREMENTS),
            _share(r.joints.t.size, states, JOINT_STATES),
        )
        for r in recordings
    ]


def _share(own: int, total: int, most: int) -> int:
    return max(ceil(own * min(most / max(total, 1), 1.0)), 2)


@contextmanager
def _progress() -> Iterator[Callable[[str], None]]:
    """Yield where to tell progress: on a terminal, or by lines to a program that asks for them."""
    if os.environ.get(LINES) == 'lines':
        yield lambda text: print(text, file=sys.stderr, flush=True)
        return
    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda text: None
        return
    with console.status('starting') as status:
        yield lambda text: status.update(escape(text))

# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Say where the gap lies, what causes it, how far it shrinks.

Writes diagnosis.json, a page to read (report.html) and the corrected model to the directory. Ends
with 3 where data or set-up are wrong (units, joints swapped, another robot): page and
diagnosis.json then say what, and no model is written.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING

from weld_twin_core.errors import DataError, ModelError
from weld_twin_nodes.cli.file_options import RARE_TABLE, table_of
from weld_twin_nodes.cli.options import (
    ALIGN,
    ROBOT,
    TOPICS,
    folder_output,
    given_urdf,
    inputs_of,
    output,
    refuse_unknown_effect,
    robot_of,
    topics_of,
    twin_of,
)

if TYPE_CHECKING:
    from weld_twin_core.arm.robot import Robot
    from weld_twin_core.arrays import Array
    from weld_twin_core.diagnosis import Diagnosis
    from weld_twin_core.diagnosis.advice import Limits
    from weld_twin_core.recording import Recording
    from weld_twin_nodes.offline.set_up_changes import SetUpChange

    from ...report.diagnosis_page import Sheet

EXAMPLE = 'weld-twin diagnose my_bag --robot ur5 --align base,tool --out found'
LINES = 'WELD_TWIN_PROGRESS'
"""Variable of the environment: 'lines' has every step told as a line on stderr."""
BRANDS = ('abb', 'fanuc', 'kuka', 'ur', 'yaskawa')
"""Makers whose controllers the page knows; the page has their names."""
TABLES = ('.csv', '.tsv', '.txt', '.dat', '.dg')
"""Endings of files that are tables of text, read as `weld-twin import` reads them."""
UNSOUND = 3
"""Exit code where data or set-up are wrong."""
MEASUREMENTS = 40_000
"""Diagnosed together; eleven minutes at 60 Hz."""
JOINT_STATES = 150_000
"""The same; twenty minutes at 125 Hz."""


OPTIONS = (
    'BAG ...                  bags or tables of one robot',
    ROBOT,
    folder_output('directory for the results'),
    f"""
how it was measured:
--holdout BAG            a recording that is not fitted; the shrink is judged on it; may be given again
{ALIGN}
--may-change NAMES       errors that may differ between the recordings, such as
                         joint_offset,tool_pose,base_pose
--apply                  if data or set-up are wrong and one correction explains it, make it and go on
rare:
--changed BAG WHAT       what was changed in the cell for one of the bags: load=KG hung from the tool
                         point (load=KG,X,Y,Z: there in the tool frame [m]; below 0: taken off),
                         another tool, or the instrument moved; may be given again
--instrument NAME        what measured: at960, at930, at901, at500, gts3800, or its largest permissible
                         error in mm, such as 0.015+0.006/m; @3 behind it: 3 m away
--contacts ARTEFACT.yaml  describes what the contacts of the bags touched, where they were not imported
                         with it
what is known of the causes:
--effects-known FILE     effects file or diagnosis.json; the twin has these effects from the start
--exclude-effect NAME ...  effects that cannot be the cause
what the page shows:
--tolerance MM           largest deviation allowed; the page says by ISO 14253-1 whether the robot
                         passes
--pdf                    print the page to report.pdf, to sign; needs Chromium
rare:
--uncertainty MM         standard uncertainty of a measured position, from the certificate of the
                         instrument
--joint-names A|J|FILE   what joints are called: a prefix (A1, A2, ...), or a YAML file of lines
                         "joint: name"
--region REGION          say how sure the corrected robot is there: a program, a bag, or a box
                         X,Y,Z:X,Y,Z (corners in the base frame, mm)
--controller {{{','.join(BRANDS)}}}  whose controller it is, if the name of the robot does not tell
the next experiment:
rare:
--experiment-minutes MIN  that it may take, with what has to be set up (default: 60)
--confirm                where the question is closed, but some joints did not move widely, plan one in
                         which they do
--cell-box NUMBERS       x,y,z of the lower and of the upper corner [m], in the measuring frame: the arm
                         stays between them
""",
    TOPICS,
    RARE_TABLE,
)


def _sheet(args: argparse.Namespace) -> Sheet:
    """Return what the page is to show; checked before anything is computed."""
    from ...report.acceptance import Demand
    from ...report.diagnosis_files import browser
    from ...report.diagnosis_page import Sheet, joint_labels

    if args.pdf:
        browser()
    labels = joint_labels(args.joint_names, robot_of(args).joint_names) if args.joint_names else {}
    sizes = [_metres(getattr(args, name), f'--{name}') for name in ('tolerance', 'uncertainty')]
    return Sheet(Demand(*sizes), labels, args.controller)


def _metres(value: float | None, option: str) -> float | None:
    if value is not None and not 0.0 < value < 1000.0:
        raise ModelError(f'{option} {value:g}: give millimetres above 0 and below 1000')
    return None if value is None else 1e-3 * value


def run(args: argparse.Namespace) -> int:
    """Diagnose, write the results, print the verdict."""
    from rich.console import Console

    from ...report import print_summary
    from ...report.diagnosis_files import PAGE, PDF, RESULT, print_page, write_results

    sheet = _sheet(args)
    with output(args, RESULT) as place:
        diagnosis = _diagnosis(args)
        inputs = inputs_of(
            recording=args.bag,
            held_out=args.holdout,
            robot=args.robot,
            effects_known=args.effects_known,
        )
        write_results(place, diagnosis, inputs, given_urdf(args), sheet)
        if args.pdf:
            print_page(place / PAGE, place / PDF)
    console = Console(highlight=False)
    print_summary(diagnosis, console, sheet.demand)
    console.print(f'report: {Path(args.out) / PAGE}', markup=False)
    return UNSOUND if diagnosis.status == 'unsound' else 0


def _diagnosis(args: argparse.Namespace) -> Diagnosis:
    from weld_twin_core.diagnosis import diagnose
    from weld_twin_core.diagnosis.algebra.problem import frames_named
    from weld_twin_core.diagnosis.frames.changes import families_named
    from weld_twin_nodes.offline.region import region
    from weld_twin_nodes.offline.set_up_changes import with_changes

    align = frames_named(args.align, '--align')
    for name in args.exclude_effect:
        refuse_unknown_effect('--exclude-effect', name)
    changing = families_named(args.may_change, '--may-change')
    if changing and len(args.bag) < 2:
        raise ModelError('--may-change compares recordings; give two or more bags of one arm')
    changes = _changes(args)
    twin = twin_of(robot_of(args), args.effects_known)
    judged = region(twin.robot, args.region)[0] if args.region else None
    with _progress() as tell:
        recordings = _read(args, twin.robot, 'base' in align, tell)
        count = len(args.bag)
        fitted, more = with_changes(_bounded(recordings[:count]), changes, twin.robot)
        result = diagnose(
            fitted,
            twin.robot,
            align=align,
            known=twin.effects,
            exclude=tuple(args.exclude_effect),
            holdout=_bounded(recordings[count:]),
            apply=args.apply,
            may_change=tuple(dict.fromkeys([*changing, *more])),
            limits=_limits(args),
            progress=tell,
        )
    return result if judged is None else _in_region(result, args.region, judged)


def _read(
    args: argparse.Namespace, robot: Robot, own_frame: bool, tell: Callable[[str], None]
) -> list[Recording]:
    """Return all recordings, as artefact and instrument are told."""
    from weld_twin_msgs_py.bags import read_recording
    from weld_twin_msgs_py.files.instruments import instrument, measured_by

    what = instrument(args.instrument) if args.instrument else None
    topics = topics_of(args)
    out: list[Recording] = []
    for path in (*args.bag, *args.holdout):
        tell(f'reading {path}')
        if Path(path).suffix.lower() in TABLES:
            result, _ = table_of(args, robot, path)  # what was assumed is in its notes
        else:
            # Two clocks are for the checks of the data to name.
            result = read_recording(path, robot, topics, one_clock=False, needs_measurements=True)
            result = _described(result, args.contacts)
        out.append(result if what is None else measured_by(result, what, own_frame=own_frame))
    return out


def _in_region(result: Diagnosis, reported: str, judged: Array) -> Diagnosis:
    """Return the diagnosis with what to expect in a region that was asked for."""
    from weld_twin_core.diagnosis.predicting.allowed import corrected_sigma

    if result.posterior is None:
        return result
    sigma = corrected_sigma(result.posterior, result.model, judged)
    return replace(result, posterior=replace(result.posterior, region=(reported, sigma)))


def _changes(args: argparse.Namespace) -> dict[int, SetUpChange]:
    """Return what was changed for which bag, counted from 0."""
    from weld_twin_nodes.offline.set_up_changes import set_up_change

    out = {}
    for bag, what in args.changed:
        if bag not in args.bag:
            raise DataError(f"--changed: '{bag}' is none of the recordings")
        out[args.bag.index(bag)] = set_up_change(what)
    return out


def _limits(args: argparse.Namespace) -> Limits:
    """Return what the next experiment may cost, and where it has to stay."""
    import numpy as np

    from weld_twin_core.diagnosis.advice import Limits
    from weld_twin_core.diagnosis.advice.postures import USUAL_MINUTES

    minutes = USUAL_MINUTES if args.experiment_minutes is None else args.experiment_minutes
    limits = Limits(minutes, confirm=args.confirm)
    if not args.cell_box:
        return limits
    try:
        numbers = [float(part) for part in args.cell_box.split(',')]
    except ValueError:
        numbers = []
    if len(numbers) != 6:
        raise DataError(f"--cell-box takes six numbers with commas, got '{args.cell_box}'")
    return replace(limits, box=np.array(numbers).reshape(2, 3))


def _described(recording: Recording, artefact: str) -> Recording:
    """Return the recording with its contacts as an artefact file describes them."""
    from weld_twin_core.contacts import Contacts
    from weld_twin_msgs_py.files.artefact_file import read_artefact

    contacts = recording.contacts
    if not artefact or contacts is None:
        return recording
    reported = Contacts(read_artefact(artefact), contacts.labels, contacts.value, contacts.sigma)
    return replace(recording, contacts=reported)


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
    """
    Yield where to tell progress; it shows on a terminal and leaves other streams alone.

    A program that shows it elsewhere asks for lines.
    """
    from rich.console import Console
    from rich.markup import escape

    if os.environ.get(LINES) == 'lines':
        yield lambda text: print(text, file=sys.stderr, flush=True)
        return
    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda text: None
        return
    with console.status('starting') as status:
        yield lambda text: status.update(escape(text))

# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Diagnose, say what to measure next, take the recording in, and go on until it is decided.

Begin with a directory and recordings; --robot and --budget belong to the beginning. Record the
experiment that it asks for (experiment.yaml, and a program with --controller), and go on with the
directory and the new bag. The directory alone tells where it stands. With --live the experiment is
run and recorded in the cell that is up, one after the other. It ends when the cause is sure, when the
budget is spent, or when nothing would part what is left, and says which.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from weld_twin_nodes.cli.options import add_force, add_robot

EXPERIMENT, BAG = 'experiment.yaml', 'recording'
SLOWER = 2.0
"""A generator that goes from station to station may take this times what was planned."""
LEAST = 0.5
"""Minutes that an experiment is planned with where hardly any are left; it is then not asked for."""
BUDGET = 60.0
"""Minutes of experiments, with what has to be set up for them, unless told: one visit to a cell."""
CHAIN = ('--base-link', '--tip-link', '--flange-link')
"""Options that say which links of a URDF the arm is between, and where its tools begin."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument('directory', metavar='DIR', help='the investigation')
    parser.add_argument('bags', nargs='*', metavar='BAG', help='recordings to begin or go on with')
    add_robot(parser, required=False)
    parser.add_argument(
        '--budget', type=float, metavar='MIN', help=f'minutes of experiments (default: {BUDGET:g})'
    )
    parser.add_argument('--align', default='', metavar='FRAMES', help='as for diagnose')
    parser.add_argument('--effects-known', default='', metavar='FILE', help='as for diagnose')
    parser.add_argument('--cell-box', default='', metavar='NUMBERS', help='as for diagnose')
    parser.add_argument(
        '--controller',
        default='',
        metavar='L',
        help='write the experiment as a program too, as export-program does',
    )
    parser.add_argument(
        '--changed',
        metavar='WHAT',
        help='what was changed in the cell for the new bags, where it was not what was asked: '
        'load=KG, tool, instrument, or nothing',
    )
    add_force(parser)
    parser.add_argument(
        '--live',
        action='store_true',
        help='run experiments with the trajectory generator and record them, in the cell that is '
        'up; stops where something in the cell has to be changed first',
    )
    parser.add_argument(
        '--playback',
        type=float,
        default=1.0,
        metavar='X',
        help='with --live: speed against real time (default: 1)',
    )


def run(args: argparse.Namespace) -> int:
    """Begin, go on, or tell where it stands."""
    from weld_twin_core.errors import DataError
    from weld_twin_nodes.offline.investigation import STATE, read_state

    from ...report.investigation_page import headline

    directory = Path(args.directory)
    begun = (directory / STATE).exists()
    if not args.bags and not args.live and (args.budget is None or not begun):
        if not begun:
            raise DataError(f"'{directory}' is no investigation; begin one with recordings")
        print(headline(read_state(directory)))
        return 0
    if not begun and not args.bags:
        raise DataError(f"'{directory}' is no investigation; begin one with recordings")
    state = _continued(args, directory) if begun else _begun(args, directory)
    if args.bags:
        state = _round(args, directory, state, args.bags, _changes(args, state))
        args.changed = None
    elif args.budget is not None:
        state = _with_budget(args, directory, state)
    # What has to be changed by hand is done when the person calls again.
    done = not args.bags
    while args.live and state['state'] == 'open' and (done or not _asked(state)['changes']):
        state = _recorded(args, directory, state)
        done = False
    return 0


def _with_budget(
    args: argparse.Namespace, directory: Path, state: dict[str, Any]
) -> dict[str, Any]:
    """Keep another budget; where nothing is asked for, plan anew from what was recorded last."""
    from weld_twin_nodes.offline.investigation import write_state

    from ...report.investigation_page import headline

    *before, last = state['rounds']
    if last['asked'] is not None:
        write_state(directory, state)
        print(headline(state))
        return state
    bags = [str(entry['path']) for entry in last['recordings']]
    changes = str(last['recordings'][0].get('changed') or '')
    # The minutes of the experiment that it came from are counted when it is taken in again.
    counted = float(before[-1]['asked']['minutes']) if before and before[-1].get('asked') else 0.0
    spent = float(state['spent_min']) - counted
    return _round(args, directory, {**state, 'rounds': before, 'spent_min': spent}, bags, changes)


def _asked(state: dict[str, Any]) -> dict[str, Any]:
    """Return what was asked for last; nothing before the first round."""
    rounds = state['rounds']
    return (rounds[-1]['asked'] if rounds else None) or {'changes': ''}


def _changes(args: argparse.Namespace, state: dict[str, Any]) -> str:
    """Return what was changed in the cell for the new bags."""
    from weld_twin_nodes.offline.set_up_changes import set_up_change

    if args.changed is None:
        return str(_asked(state).get('changes') or '')
    return '' if args.changed == 'nothing' else str(set_up_change(args.changed))


def _recorded(args: argparse.Namespace, directory: Path, state: dict[str, Any]) -> dict[str, Any]:
    """Run and record what is asked for in the cell that is up, and take it in."""
    from weld_twin_core.errors import DataError
    from weld_twin_nodes.harness.recorded_experiment import recorded_experiment

    if 'robot_minutes' not in _asked(state):
        raise DataError(f"nothing is asked for in '{directory}'; go on with a recording")
    place = directory / f'round-{len(state["rounds"]) - 1}'
    seconds = 60.0 * SLOWER * float(_asked(state)['robot_minutes']) / max(args.playback, LEAST)
    bag = recorded_experiment(
        place / EXPERIMENT, state['robot'], seconds, place / BAG, playback=args.playback
    )
    return _round(args, directory, state, [str(bag)], _changes(args, state))


def _begun(args: argparse.Namespace, directory: Path) -> dict[str, Any]:
    from weld_twin_core.errors import DataError
    from weld_twin_nodes.offline.investigation import begin

    if not args.robot:
        raise DataError('an investigation begins with --robot')
    if directory.exists() and any(directory.iterdir()):
        raise DataError(f"'{directory}' holds something else already; choose another place")
    budget = BUDGET if args.budget is None else args.budget
    if not 0.0 <= budget < 1e6:
        raise DataError(f'--budget must be minutes, got {budget}')
    words = [('--align', args.align), ('--effects-known', args.effects_known)]
    words += [('--cell-box', args.cell_box)]
    words += zip(CHAIN, (args.base_link, args.tip_link, args.flange_link), strict=True)
    # A box may begin with a minus, and is then taken for an option unless it is joined.
    options = [f'{word}={value}' for word, value in words if value]
    return begin(args.robot, options, budget)


def _continued(args: argparse.Namespace, directory: Path) -> dict[str, Any]:
    from weld_twin_core.errors import DataError
    from weld_twin_nodes.offline.investigation import read_state

    state = read_state(directory)
    if args.robot and args.robot != state['robot']:
        raise DataError(
            f"the investigation is of robot '{state['robot']}', not of '{args.robot}'; begin another"
        )
    if args.budget is not None:
        state['budget_min'] = args.budget
        state['state'] = 'open'
    if state['state'] != 'open':
        raise DataError(
            f'the investigation has ended, {state["state"]}: {state["why"]}; '
            'a larger --budget opens it again'
        )
    return state


def _round(
    args: argparse.Namespace,
    directory: Path,
    state: dict[str, Any],
    bags: list[str],
    changes: str,
) -> dict[str, Any]:
    """Diagnose everything so far, and ask or end; return the state after it."""
    from weld_twin_nodes.offline.investigation import PAGE, foreseen, take_in, write_state
    from weld_twin_nodes.offline.output_directory import write_owned

    from ...report.investigation_page import headline, investigation_page

    place = directory / f'round-{len(state["rounds"])}'
    heard = _heard(state, bags, changes, place, force=args.force)
    state = take_in(state, bags, *heard, changes)
    asked = state['rounds'][-1]['asked']
    if asked is not None:
        _write_experiment(args, place, state, asked)
    write_state(directory, state)
    write_owned(directory / PAGE, investigation_page(state))
    print(headline(state))
    if asked is not None:
        print(f'{asked["reason"]} Beforehand: {foreseen(asked)}.')
        print(f'record {place / EXPERIMENT}, then: weld-twin investigate {directory} BAG')
    print(f'page: {directory / PAGE}')
    return state


def _heard(
    state: dict[str, Any], bags: list[str], changes: str, place: Path, *, force: bool
) -> tuple[Mapping[str, Any], str]:
    """Diagnose all recordings, and the experiments by themselves; return what to believe."""
    from weld_twin_core.errors import TwinError
    from weld_twin_nodes.offline.closing import weighed
    from weld_twin_nodes.offline.investigation import changed, recordings
    from weld_twin_nodes.offline.set_up_changes import FRAMES

    first, later = recordings(state)
    told = {**changed(state), **(dict.fromkeys(bags, changes) if changes else {})}
    # Seen with another tool, or from elsewhere, they cannot be held against the first.
    by_itself = not first or any(what in FRAMES for what in told.values())
    every = [*first, *later, *bags]
    found = _diagnosed(every, state, place, told, confirm=by_itself, force=force)
    if by_itself:
        return weighed(found)
    beside = place.with_name(f'{place.name}-experiments')
    try:
        return weighed(found, _diagnosed([*later, *bags], state, beside, told, force=force))
    except TwinError:  # too few to be diagnosed by themselves
        return weighed(found)


def _diagnosed(
    bags: list[str],
    state: dict[str, Any],
    place: Path,
    changes: Mapping[str, str],
    *,
    force: bool,
    confirm: bool = False,
) -> dict[str, Any]:
    """Run the diagnosis as its own command does; return the content of diagnosis.json."""
    from ...report.diagnosis_files import RESULT
    from . import diagnose

    parser = argparse.ArgumentParser()
    diagnose.add_arguments(parser)
    left = max(float(state['budget_min']) - float(state['spent_min']), LEAST)
    words = [*bags, '--robot', state['robot'], '--out', str(place), *state['options']]
    words += ['--experiment-minutes', f'{left:g}', *(['--force'] if force else [])]
    words += ['--confirm'] if confirm else []
    words += [word for bag in bags if bag in changes for word in ('--changed', bag, changes[bag])]
    diagnose.run(parser.parse_args(words))
    found: dict[str, Any] = json.loads((place / RESULT).read_text(encoding='utf-8'))
    return found


def _write_experiment(
    args: argparse.Namespace, place: Path, state: dict[str, Any], asked: dict[str, Any]
) -> None:
    """Write the experiment for the generator, and as a program where a controller is named."""
    from weld_twin_msgs_py.files.joint_file import write_joint_motion
    from weld_twin_nodes.offline.output_directory import new_directory

    with new_directory(place, mark=EXPERIMENT, force=args.force, shared=True) as made:
        write_joint_motion(made / EXPERIMENT, asked.pop('motion'), asked['sentence'])
        if args.controller:
            _write_program(args, state, made, place)


def _write_program(
    args: argparse.Namespace, state: dict[str, Any], made: Path, place: Path
) -> None:
    from weld_twin_core.errors import TwinError
    from weld_twin_msgs_py.programs.languages import LANGUAGES
    from weld_twin_nodes.cli.commands import export_program

    suffix = LANGUAGES[args.controller].extensions[0] if args.controller in LANGUAGES else '.txt'
    name = f'experiment{suffix}'
    parser = argparse.ArgumentParser()
    export_program.add_arguments(parser)
    words = [str(made / EXPERIMENT), '--robot', state['robot']]
    words += [word for word in state['options'] if word.partition('=')[0] in CHAIN]
    words += ['--controller', args.controller, '--out', str(made / name)]
    try:
        lines = export_program.write_program(parser.parse_args(words), made / name, place / name)
    except TwinError as error:
        lines = [f'note: no program was written: {error}']
    print('\n'.join(lines))

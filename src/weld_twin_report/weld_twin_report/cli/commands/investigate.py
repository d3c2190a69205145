# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Diagnose, say what to measure next, until it is decided.

Before anything is measured, --tolerance plans how many postures and which; DIR gets them with a
table to fill in. With --model it plans on top of a diagnosis. Begin with DIR, recordings, --robot
and --budget. Record the experiment that it asks for (experiment.yaml), and go on with DIR and the
new bag. DIR alone tells where it stands. It ends when the cause is sure, when the budget is spent,
or when nothing would part what is left, and says which.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from weld_twin_core.errors import DataError, TwinError
from weld_twin_nodes.cli.file_options import PROGRAM, TRIGGER, check_program, context_of
from weld_twin_nodes.cli.options import ANY_ROBOT, FORCE, links_of, output, refuse, robot_of
from weld_twin_nodes.cli.parsing import add_options

if TYPE_CHECKING:
    from weld_twin_core.arm.robot import Robot
    from weld_twin_core.arrays import Array
    from weld_twin_msgs_py.programs import Context
    from weld_twin_nodes.offline.measurement_plan import Planned

EXAMPLE = 'weld-twin investigate cell7 bags/elbow_play --robot ur5 --budget 45'
EXPERIMENT, BAG = 'experiment.yaml', 'recording'
SLOWER = 2.0
"""A generator that goes from station to station may take this times what was planned."""
LEAST = 0.5
"""Minutes that an experiment is planned with where hardly any are left; it is then not asked for."""
BUDGET = 60.0
"""Minutes of experiments, with what has to be set up for them, unless told: one visit to a cell."""
CHAIN = ('--base-link', '--tip-link', '--flange-link')
"""Options that say which links of a URDF the arm is between, and where its tools begin."""
PLAN = {'minutes': None, 'postures': None, 'noise': 0.03, 'seconds': 10.0, 'spread': 75.0}
"""What a plan is made with unless told: minutes, number, mm, s and degrees."""


OPTIONS = (
    """
[DIR]                    the investigation
[BAG ...]                recordings to begin or go on with
""",
    ANY_ROBOT,
    """
--budget MIN             minutes of experiments (default: 60)
--align FRAMES           as for diagnose
--controller L           write what is to be measured as a program too, as export program does
--changed WHAT           what was changed in the cell for the new bags, where it was not what was
                         asked: load=KG, tool, instrument, or nothing
--live                   run and record experiments in the cell that is up, until something has to be
                         changed
rare:
--effects-known FILE     as for diagnose
--cell-box NUMBERS       as for diagnose
--playback X             with --live: speed against real time [default: 1]
""",
    FORCE,
    """
plan the first measurement:
--tolerance MM           of the tool, such as 0.3; asks for a plan
--minutes MIN            there is time for
--postures N             so many, in place of as many as are needed
--noise MM               standard deviation of a measured coordinate: about 0.03 with a tracker or a
                         measuring arm, 0.1 with cameras, 0.1 to 0.2 with a pin (default: 0.03)
--model FILE             diagnosis.json: plan what to measure on top of it
--region REGION          where the tool is to be sure, with --model: a program, a bag, or a box
                         X,Y,Z:X,Y,Z (corners in the base frame, mm); the whole reach if left out
rare:
--seconds S              that one station takes, the way to it apart (default: 10)
--spread DEG             every joint turns so far to either side of a usual posture (default: 75)
--out FOLDER             where the plan goes, instead of DIR
""",
    TRIGGER,
    PROGRAM,
)


def run(args: argparse.Namespace) -> int:
    """Plan, begin, go on, or tell where it stands."""
    if args.tolerance is not None:
        return _planned(args)
    refuse(
        args,
        (*PLAN, 'out', 'model', 'region'),
        'is of a plan; say with --tolerance what it is for',
    )
    if not args.dir:
        raise DataError('give DIR, the folder of the investigation, or plan with --tolerance')
    return _investigated(args)


def _planned(args: argparse.Namespace) -> int:
    """Print how many stations and how sure; write the files."""
    from math import radians

    from weld_twin_nodes.offline.measurement_plan import plan_table

    refuse(args, ('live', 'budget', 'changed'), 'is of an investigation, not of a plan')
    if args.bag:
        raise DataError('a plan comes before the first recording; leave --tolerance or BAG out')
    if not args.robot:
        raise DataError('a plan needs --robot')
    if args.controller:
        check_program(args)
    args.out = args.out or args.dir
    if args.controller and not args.out:
        raise DataError('--controller writes a program; say with --out where')
    if args.minutes is None and args.postures is None:
        raise DataError('say with --minutes for how long there is time, or how many --postures')
    given = {name: getattr(args, name) for name in PLAN if getattr(args, name) is not None}
    how: dict[str, Any] = {**PLAN, **given}
    minutes = 1.0 if how['minutes'] is None else how['minutes']
    if not (0.0 < how['seconds'] <= 3600.0 and 0.0 < minutes <= 10_000.0):
        raise DataError(
            'time must be above zero: --minutes at most 10000, --seconds at most 3600 for a posture'
        )
    how |= {'noise': how['noise'] * 1e-3, 'spread': radians(how['spread'])}
    if args.region and not args.model:
        raise DataError('--region says where a fitted model is to be sure; give it with --model')
    robot, tolerance = robot_of(args), args.tolerance * 1e-3
    plan = (_more if args.model else _first)(args, robot, tolerance, how)
    print('\n'.join(plan_table(plan, tolerance)))
    if args.out:
        _write_plan(args, robot, plan, how['seconds'])
    return 0


def _first(
    args: argparse.Namespace, robot: Robot, tolerance: float, how: dict[str, Any]
) -> Planned:
    """Return the plan of a first measurement."""
    from weld_twin_core.diagnosis.predicting.planned import plan_stations
    from weld_twin_nodes.offline.measurement_plan import planned

    given = (tolerance, how['noise'], how['spread'])
    time = (how['minutes'], how['seconds'], how['postures'])
    return planned(robot, lambda count: plan_stations(robot, count, *given), *time)


def _more(
    args: argparse.Namespace, robot: Robot, tolerance: float, how: dict[str, Any]
) -> Planned:
    """Return the plan of what to measure on top of a diagnosis, and say how sure it is so far."""
    from weld_twin_core.diagnosis.predicting.planned import Wanted, plan_more
    from weld_twin_core.effects.dated import of_the_robot
    from weld_twin_core.twin.twin import Twin
    from weld_twin_msgs_py.files.diagnosis_model import load_model, read_model
    from weld_twin_msgs_py.files.posterior_entry import read_posterior
    from weld_twin_nodes.offline.measurement_plan import planned
    from weld_twin_nodes.offline.region import anywhere

    posterior, model = read_posterior(robot, args.model), read_model(robot, args.model)
    if posterior is None:
        raise DataError(
            f"the diagnosis '{args.model}' does not say how sure it is; diagnose again"
        )
    effects, posterior = posterior.centred(model.found)
    placed = load_model(robot, args.model).robot
    twin = Twin(placed, of_the_robot((*model.known, *effects)))
    postures = _in_region(args, robot) if args.region else anywhere(robot, how['spread'])
    wanted = Wanted(tolerance, how['noise'])
    plan = planned(
        robot,
        lambda count: plan_more(posterior, twin, postures, count, wanted),
        *(how['minutes'], how['seconds'], how['postures']),
        least=1,
        offered=len(postures[1]),
    )
    where = f"in the region '{args.region}'" if args.region else 'elsewhere in its reach'
    print(
        f'so far the corrected robot may be off by {plan.sigma[0] * 1e3:.2g} mm {where} '
        '(one standard deviation)'
    )
    return plan


def _in_region(args: argparse.Namespace, robot: Robot) -> tuple[Array, Array]:
    """Return the postures of --region."""
    from weld_twin_msgs_py.programs.languages import language_of
    from weld_twin_msgs_py.programs.source import read_source
    from weld_twin_nodes.offline.region import region

    language = ''
    if Path(args.region).is_file():
        language = language_of(read_source(args.region), args.region, args.controller or '')
    context = context_of(args, robot, language or args.controller or 'csv')
    return region(robot, args.region, context, language)


def _write_plan(args: argparse.Namespace, robot: Robot, plan: Planned, seconds: float) -> None:
    import numpy as np

    from weld_twin_nodes.offline.measurement_plan import STATIONS, TABLE, write_plan

    # Without a controller the table counts as the model does, which this one's language does too.
    context = context_of(args, robot, args.controller or 'csv')
    out, lines = Path(args.out), list[str]()
    with output(args, TABLE) as folder:
        write_plan(folder, context, args.controller or None, plan)
        if args.controller:
            lines = _program(args, context, folder / STATIONS, out, 'measure', seconds)
    print('\n'.join([f'stations: {out / STATIONS}', f'table to fill in: {out / TABLE}', *lines]))
    counted = np.array_equal(context.controller.mix, np.eye(robot.n))
    if not counted and not context.controller.external:
        print('J3 counts from the ground there: import the table with --coupled 3+2')


def _program(
    args: argparse.Namespace,
    context: Context,
    path: Path,
    shown_in: Path,
    name: str,
    dwell: float | None = None,
) -> list[str]:
    """Write a path file as a program beside it, and return what to tell."""
    from weld_twin_msgs_py.programs.languages import LANGUAGES
    from weld_twin_nodes.offline.exporting import Speeds, write_program

    name += LANGUAGES[args.controller].extensions[0]
    how = Speeds() if dwell is None else Speeds(dwell=dwell)
    places = (path.with_name(name), shown_in / name)
    return write_program(*places, str(path), context, args.controller, how, trigger=args.trigger)


def _investigated(args: argparse.Namespace) -> int:
    """Begin, go on, or tell where it stands."""
    from weld_twin_nodes.offline.investigation import STATE, read_state

    from ...report.investigation_page import headline

    directory = Path(args.dir)
    begun = (directory / STATE).exists()
    if not begun and not args.bag:
        raise DataError(
            f"'{directory}' is no investigation; begin one with recordings, or plan with --tolerance"
        )
    if not args.bag and not args.live and args.budget is None:
        print(headline(read_state(directory)))
        return 0
    going = _Investigation(args, directory, begun)
    if args.bag:
        going.take_in(args.bag, going.changes(args.changed))
    elif args.budget is not None:
        going.plan_anew()
    if args.live:
        going.record()
    return 0


class _Investigation:
    """An investigation in its folder, as it goes on with what was given."""

    def __init__(self, args: argparse.Namespace, directory: Path, begun: bool) -> None:
        self.args, self.directory = args, directory
        self.state = self._continued() if begun else self._begun()

    def _begun(self) -> dict[str, Any]:
        from weld_twin_nodes.offline.investigation import begin
        from weld_twin_nodes.offline.measurement_plan import TABLE

        args, place = self.args, self.directory
        if not args.robot:
            raise DataError('an investigation begins with --robot')
        if place.exists() and any(place.iterdir()) and not (place / TABLE).exists():
            raise DataError(f"'{place}' holds something else already; choose another place")
        budget = BUDGET if args.budget is None else args.budget
        if not 0.0 <= budget < 1e6:
            raise DataError(f'--budget must be minutes, got {budget}')
        words = [('--align', args.align), ('--effects-known', args.effects_known)]
        words += [('--cell-box', args.cell_box)]
        words += zip(CHAIN, (link or '' for link in links_of(args)), strict=True)
        # A box may begin with a minus, and is then taken for an option unless it is joined.
        return begin(args.robot, [f'{word}={value}' for word, value in words if value], budget)

    def _continued(self) -> dict[str, Any]:
        from weld_twin_nodes.offline.investigation import read_state

        state, robot = read_state(self.directory), self.args.robot
        if robot and robot != state['robot']:
            raise DataError(
                f"the investigation is of robot '{state['robot']}', not of '{robot}'; begin another"
            )
        if self.args.budget is not None:
            state |= {'budget_min': self.args.budget, 'state': 'open'}
        if state['state'] != 'open':
            raise DataError(
                f'the investigation has ended, {state["state"]}: {state["why"]}; '
                'a larger --budget opens it again'
            )
        return state

    @property
    def asked(self) -> dict[str, Any]:
        """Return what was asked for last; nothing before the first round."""
        rounds = self.state['rounds']
        return (rounds[-1]['asked'] if rounds else None) or {'changes': ''}

    def changes(self, told: str = '') -> str:
        """Return what was changed in the cell for the new bags: as told, or as was asked."""
        from weld_twin_nodes.offline.set_up_changes import set_up_change

        if not told:
            return str(self.asked.get('changes') or '')
        return '' if told == 'nothing' else str(set_up_change(told))

    def plan_anew(self) -> None:
        """Keep another budget; where nothing is asked for, plan anew from what was recorded last."""
        from weld_twin_nodes.offline.investigation import write_state

        from ...report.investigation_page import headline

        *before, last = self.state['rounds']
        if last['asked'] is not None:
            write_state(self.directory, self.state)
            print(headline(self.state))
            return
        bags = [str(entry['path']) for entry in last['recordings']]
        # The minutes of the experiment that it came from are counted when it is taken in again.
        asked = before[-1].get('asked') if before else None
        counted = float(asked['minutes']) if asked else 0.0
        self.state |= {'rounds': before, 'spent_min': float(self.state['spent_min']) - counted}
        self.take_in(bags, str(last['recordings'][0].get('changed') or ''))

    def record(self) -> None:
        """Run and record what is asked for in the cell that is up, until something has to be changed."""
        from weld_twin_nodes.harness.recorded_experiment import recorded_experiment

        # What has to be changed by hand is done when the person calls again.
        done = not self.args.bag
        while self.state['state'] == 'open' and (done or not self.asked['changes']):
            if 'robot_minutes' not in self.asked:
                raise DataError(
                    f"nothing is asked for in '{self.directory}'; go on with a recording"
                )
            place = self.directory / f'round-{len(self.state["rounds"]) - 1}'
            speed = self.args.playback
            seconds = 60.0 * SLOWER * float(self.asked['robot_minutes']) / max(speed, LEAST)
            where = (place / EXPERIMENT, self.state['robot'], seconds, place / BAG)
            bag = recorded_experiment(*where, playback=speed)
            told = '' if self.args.bag else self.args.changed
            self.take_in([str(bag)], self.changes(told))
            done = False

    def take_in(self, bags: list[str], changes: str) -> None:
        """Diagnose everything so far, and ask or end."""
        from weld_twin_nodes.offline.investigation import PAGE, foreseen, take_in, write_state
        from weld_twin_nodes.offline.output_directory import write_owned

        from ...report.investigation_page import headline, investigation_page

        place = self.directory / f'round-{len(self.state["rounds"])}'
        self.state = take_in(self.state, bags, *self._heard(bags, changes, place), changes)
        asked = self.state['rounds'][-1]['asked']
        if asked is not None:
            self._write_experiment(place, asked)
        write_state(self.directory, self.state)
        write_owned(self.directory / PAGE, investigation_page(self.state))
        print(headline(self.state))
        if asked is not None:
            print(f'{asked["reason"]} Beforehand: {foreseen(asked)}.')
            print(f'record {place / EXPERIMENT}, then: weld-twin investigate {self.directory} BAG')
        print(f'page: {self.directory / PAGE}')

    def _heard(self, bags: list[str], changes: str, place: Path) -> tuple[Mapping[str, Any], str]:
        """Diagnose all recordings, and the experiments by themselves; return what to believe."""
        from weld_twin_nodes.offline.investigation import changed, recordings, weighed
        from weld_twin_nodes.offline.set_up_changes import FRAMES

        first, later = recordings(self.state)
        known = {**changed(self.state), **(dict.fromkeys(bags, changes) if changes else {})}
        # Seen with another tool, or from elsewhere, they cannot be held against the first.
        by_itself = not first or any(what in FRAMES for what in known.values())
        every = [*first, *later, *bags]
        result = self._diagnosed(every, place, known, ['--confirm'] * by_itself)
        if by_itself:
            return weighed(result)
        beside = place.with_name(f'{place.name}-experiments')
        try:
            return weighed(result, self._diagnosed([*later, *bags], beside, known))
        except TwinError:  # too few to be diagnosed by themselves
            return weighed(result)

    def _diagnosed(
        self, bags: list[str], place: Path, changes: Mapping[str, str], more: Sequence[str] = ()
    ) -> dict[str, Any]:
        """Run the diagnosis as its own command does; return the content of diagnosis.json."""
        from weld_twin_msgs_py.files.whole_files import read_json

        from ...report.diagnosis_files import RESULT
        from . import diagnose

        parser = argparse.ArgumentParser()
        add_options(parser, *diagnose.OPTIONS)
        state = self.state
        remaining = max(float(state['budget_min']) - float(state['spent_min']), LEAST)
        words = [*bags, '--robot', state['robot'], '--out', str(place), *state['options'], *more]
        words += ['--experiment-minutes', f'{remaining:g}', *(['--force'] * self.args.force)]
        words += [w for bag in bags if bag in changes for w in ('--changed', bag, changes[bag])]
        diagnose.run(parser.parse_args(words))
        return read_json(place / RESULT)

    def _write_experiment(self, place: Path, asked: dict[str, Any]) -> None:
        """Write the experiment for the generator, and as a program where a controller is named."""
        from weld_twin_msgs_py.files.joint_file import write_joint_motion
        from weld_twin_msgs_py.robots import load_robot
        from weld_twin_nodes.offline.output_directory import new_directory

        args, state = self.args, self.state
        with new_directory(place, mark=EXPERIMENT, force=args.force, shared=True) as made:
            write_joint_motion(made / EXPERIMENT, asked.pop('motion'), asked['sentence'])
            if not args.controller:
                return
            words = dict(word.split('=', 1) for word in state['options'])
            robot = load_robot(state['robot'], *(words.get(option) for option in CHAIN))
            try:
                check_program(args)
                context = context_of(args, robot, args.controller)
                lines = _program(args, context, made / EXPERIMENT, place, 'experiment')
            except TwinError as error:
                lines = [f'note: no program was written: {error}']
            print('\n'.join(lines))

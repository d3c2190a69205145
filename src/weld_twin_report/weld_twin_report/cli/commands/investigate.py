# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Diagnose, say what to measure next, until it is decided."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from math import radians
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError, TwinError
from weld_twin_msgs_py.files.whole_files import read_json
from weld_twin_nodes.cli.given import Given
from weld_twin_nodes.cli.parsing import add_options, names_of
from weld_twin_nodes.offline import investigation
from weld_twin_nodes.offline.set_up_changes import FRAMES, set_up_change

from ...report.investigation_page import headline, investigation_page
from . import OF_PLAN, ROWS

if TYPE_CHECKING:
    from weld_twin_msgs_py.programs import Context
    from weld_twin_nodes.offline.measurement_plan import Planned

EXPERIMENT, BAG = 'experiment.yaml', 'recording'
SLOWER = 2.0
"""A generator that goes from station to station may take this times what was planned."""
LEAST = 0.5
"""Minutes that an experiment is planned with where hardly any are left; it is then not asked for."""
BUDGET = 60.0
"""Minutes of experiments, with what has to be set up for them, unless given: one visit to a cell."""
PASSED_ON = (
    *('align', 'effects_known', 'cell_box'),
    *('base_link', 'tip_link', 'flange_link'),
)
"""Options of the beginning that every diagnosis takes."""
PLAN = {'minutes': None, 'postures': None, 'noise': 0.03, 'seconds': 10.0, 'spread': 75.0}
"""What a plan is made with unless given: minutes, number, mm, s and degrees."""


def run(given: Given) -> int:
    """Plan, begin, go on, or tell where it stands."""
    if given.tolerance is not None:
        return _planned(given)
    given.refuse(names_of(OF_PLAN), 'is of a plan; say with --tolerance what it is for')
    if not given.dir:
        raise DataError('give DIR, the folder of the investigation, or plan with --tolerance')
    return _investigated(given)


def _planned(given: Given) -> int:
    """Print how many stations and how sure; write the files."""
    from weld_twin_nodes.offline.exporting import without_limits
    from weld_twin_nodes.offline.measurement_plan import plan_table

    given.refuse(('live', 'budget', 'changed'), 'is of an investigation, not of a plan')
    if given.bag:
        raise DataError('a plan comes before the first recording; leave --tolerance or BAG out')
    if not given.robot:
        raise DataError('a plan needs --robot')
    if given.controller:
        given.check_program()
    given.out = given.out or given.dir
    if given.controller and not given.out:
        raise DataError('--controller writes a program; say with --out where')
    if given.minutes is None and given.postures is None:
        raise DataError('say with --minutes for how long there is time, or how many --postures')
    unset = {name: usual for name, usual in PLAN.items() if getattr(given, name) is None}
    vars(given).update(unset)
    minutes = 1.0 if given.minutes is None else given.minutes
    if not (0.0 < given.seconds <= 3600.0 and 0.0 < minutes <= 10_000.0):
        raise DataError(
            'time must be above zero: --minutes at most 10000, --seconds at most 3600 for a posture'
        )
    if given.region and not given.model:
        raise DataError('--region says where a fitted model is to be sure; give it with --model')
    robot, tolerance = given.load_robot(), given.tolerance * 1e-3
    # Without a controller the table counts as the model does, which this one's language does too.
    language, model = given.controller or 'csv', given.model if given.controller else None
    context = given.program_context(robot, language, model) if given.out else None
    plan = (_more if given.model else _first)(given, robot, tolerance)
    print('\n'.join(plan_table(plan, tolerance, diagnosed=bool(given.model))))
    if not given.controller:  # its program says so
        print(*(f'note: {note}\n' for note in without_limits(robot)), sep='', end='')
    if context is not None:
        _write_plan(given, robot, context, plan)
    return 0


def _first(given: Given, robot: Robot, tolerance: float) -> Planned:
    from weld_twin_core.diagnosis.predicting.planned import plan_stations
    from weld_twin_nodes.offline.measurement_plan import planned

    how = (tolerance, given.noise * 1e-3, radians(given.spread))
    time = (given.minutes, given.seconds, given.postures)
    return planned(robot, lambda count: plan_stations(robot, count, *how), *time)


def _more(given: Given, robot: Robot, tolerance: float) -> Planned:
    """Return the plan of what to measure on top of a diagnosis, and say how sure it is so far."""
    from weld_twin_core.diagnosis.predicting.planned import Wanted, plan_more
    from weld_twin_core.effects.dated import of_the_robot
    from weld_twin_core.twin.twin import Twin
    from weld_twin_msgs_py.files.diagnosis_model import load_model, read_model
    from weld_twin_msgs_py.files.posterior_entry import read_posterior
    from weld_twin_nodes.offline.measurement_plan import planned
    from weld_twin_nodes.offline.region import anywhere

    posterior, model = read_posterior(robot, given.model), read_model(robot, given.model)
    if posterior is None:
        raise DataError(
            f"the diagnosis '{given.model}' does not say how sure it is; diagnose again"
        )
    effects, posterior = posterior.centred(model.found)
    placed = load_model(robot, given.model).robot
    twin = Twin(placed, of_the_robot((*model.known, *effects)))
    spread = radians(given.spread)
    postures = _in_region(given, robot) if given.region else anywhere(robot, spread)
    wanted = Wanted(tolerance, given.noise * 1e-3)
    plan = planned(
        robot,
        lambda count: plan_more(posterior, twin, postures, count, wanted),
        *(given.minutes, given.seconds, given.postures),
        least=1,
        offered=len(postures[1]),
    )
    where = f"in the region '{given.region}'" if given.region else 'elsewhere in its reach'
    print(
        f'so far the corrected robot may be off by {plan.sigma[0] * 1e3:.2g} mm {where} '
        '(one standard deviation)'
    )
    return plan


def _in_region(given: Given, robot: Robot) -> tuple[Array, Array]:
    from weld_twin_msgs_py.programs.languages import language_of
    from weld_twin_msgs_py.programs.source import read_source
    from weld_twin_nodes.offline.region import region

    language = ''
    if Path(given.region).is_file():
        language = language_of(read_source(given.region), given.region, given.controller)
    context = given.program_context(robot, language or given.controller or 'csv', given.model)
    return region(robot, given.region, context, language)


def _write_plan(given: Given, robot: Robot, context: Context, plan: Planned) -> None:
    from weld_twin_nodes.offline.measurement_plan import STATIONS, TABLE, write_plan

    out, lines = Path(given.out), list[str]()
    with given.output(TABLE) as folder:
        write_plan(folder, context, given.controller or None, plan)
        if given.controller:
            how = {'dwell': given.seconds}
            lines = _program(given, context, folder / STATIONS, out / 'measure', **how)
    print('\n'.join([f'stations: {out / STATIONS}', f'table to fill in: {out / TABLE}', *lines]))
    counted = np.array_equal(context.controller.mix, np.eye(robot.n))
    if not counted and not context.controller.external:
        print('J3 counts from the ground there: import the table with --coupled 3+2')


def _program(
    given: Given, context: Context, path: Path, shown_as: Path, **how: float
) -> list[str]:
    """Write a path file as a program beside it, and return what to tell."""
    from weld_twin_msgs_py.programs.languages import LANGUAGES
    from weld_twin_nodes.offline.exporting import Speeds, write_program

    name = shown_as.name + LANGUAGES[given.controller].extensions[0]
    places = (path.with_name(name), shown_as.with_name(name))
    speeds = Speeds(**how)
    return write_program(
        *places, str(path), context, given.controller, speeds, trigger=given.trigger
    )


def _investigated(given: Given) -> int:
    """Begin, go on, or tell where it stands."""
    directory = Path(given.dir)
    begun = (directory / investigation.STATE).exists()
    if not begun and not given.bag:
        raise DataError(
            f"'{directory}' is no investigation; begin one with recordings, or plan with --tolerance"
        )
    if not given.bag and not given.live and given.budget is None:
        print(headline(investigation.read_state(directory)))
        return 0
    going = _Investigation(given, directory, begun)
    if given.bag:
        going.take_in(given.bag, going.changes(given.changed))
    elif given.budget is not None:
        going.plan_anew()
    if given.live:
        going.record()
    return 0


class _Investigation:
    """An investigation in its folder, as it goes on with what was given."""

    def __init__(self, given: Given, directory: Path, begun: bool) -> None:
        self.given, self.directory = given, directory
        self.state = self._continued() if begun else self._begun()

    def _begun(self) -> dict[str, Any]:
        from weld_twin_nodes.offline.measurement_plan import TABLE

        given, place = self.given, self.directory
        if not given.robot:
            raise DataError('an investigation begins with --robot')
        if place.exists() and any(place.iterdir()) and not (place / TABLE).exists():
            raise DataError(f"'{place}' holds something else already; choose another place")
        budget = BUDGET if given.budget is None else given.budget
        if not 0.0 <= budget < 1e6:
            raise DataError(f'--budget must be minutes, got {budget}')
        words = {f'--{name.replace("_", "-")}': getattr(given, name) for name in PASSED_ON}
        # A box may begin with a minus, and is then taken for an option unless it is joined.
        joined = [f'{word}={value}' for word, value in words.items() if value]
        return investigation.begin(given.robot, joined, budget)

    def _continued(self) -> dict[str, Any]:
        state, robot = investigation.read_state(self.directory), self.given.robot
        if robot and robot != state['robot']:
            raise DataError(
                f"the investigation is of robot '{state['robot']}', not of '{robot}'; begin another"
            )
        if self.given.budget is not None:
            state |= {'budget_min': self.given.budget, 'state': 'open'}
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

    def changes(self, given: str = '') -> str:
        """Return what was changed in the cell for the new bags: as reported, or as was asked."""
        if not given:
            return str(self.asked.get('changes') or '')
        return '' if given == 'nothing' else str(set_up_change(given))

    def plan_anew(self) -> None:
        """Keep another budget; where nothing is asked for, plan anew from what was recorded last."""
        *before, last = self.state['rounds']
        if last['asked'] is not None:
            investigation.write_state(self.directory, self.state)
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
        done = not self.given.bag
        while self.state['state'] == 'open' and (done or not self.asked['changes']):
            if 'robot_minutes' not in self.asked:
                raise DataError(
                    f"nothing is asked for in '{self.directory}'; go on with a recording"
                )
            place = self.directory / f'round-{len(self.state["rounds"]) - 1}'
            speed = self.given.playback
            seconds = 60.0 * SLOWER * float(self.asked['robot_minutes']) / max(speed, LEAST)
            where = (place / EXPERIMENT, self.state['robot'], seconds, place / BAG)
            bag = recorded_experiment(*where, playback=speed)
            self.take_in([str(bag)], self.changes('' if self.given.bag else self.given.changed))
            done = False

    def take_in(self, bags: list[str], changes: str) -> None:
        """Diagnose everything so far, and ask or end."""
        from weld_twin_nodes.offline.output_directory import write_owned

        place = self.directory / f'round-{len(self.state["rounds"])}'
        believed = self._diagnosed_twice(bags, changes, place)
        self.state = investigation.take_in(self.state, bags, *believed, changes)
        asked = self.state['rounds'][-1]['asked']
        if asked is not None:
            self._write_experiment(place, asked)
        page = self.directory / investigation.PAGE
        investigation.write_state(self.directory, self.state)
        write_owned(page, investigation_page(self.state))
        print(headline(self.state))
        if asked is not None:
            print(f'{asked["reason"]} Beforehand: {investigation.foreseen(asked)}.')
            print(f'record {place / EXPERIMENT}, then: weld-twin investigate {self.directory} BAG')
        print(f'page: {page}')

    def _diagnosed_twice(
        self, bags: list[str], changes: str, place: Path
    ) -> tuple[Mapping[str, Any], str]:
        """Diagnose all recordings, and the experiments by themselves; return what to believe."""
        first, later = investigation.recordings(self.state)
        known = investigation.changed(self.state)
        known |= dict.fromkeys(bags, changes) if changes else {}
        # Seen with another tool, or from elsewhere, they cannot be compared with the first.
        by_itself = not first or any(what in FRAMES for what in known.values())
        every = [*first, *later, *bags]
        result = self._diagnosed(every, place, known, ['--confirm'] * by_itself)
        if by_itself:
            return investigation.weighed(result)
        beside = place.with_name(f'{place.name}-experiments')
        try:
            alone = self._diagnosed([*later, *bags], beside, known)
        except TwinError:  # too few to be diagnosed by themselves
            return investigation.weighed(result)
        return investigation.weighed(result, alone)

    def _diagnosed(
        self, bags: list[str], place: Path, changes: Mapping[str, str], more: Sequence[str] = ()
    ) -> dict[str, Any]:
        """Run the diagnosis as its own command does; return the content of diagnosis.json."""
        from ...report.diagnosis_files import RESULT
        from . import diagnose

        parser = argparse.ArgumentParser()
        add_options(parser, *ROWS['diagnose'].options)
        state = self.state
        remaining = max(float(state['budget_min']) - float(state['spent_min']), LEAST)
        words = [*bags, '--robot', state['robot'], '--out', str(place), *state['options'], *more]
        words += ['--experiment-minutes', f'{remaining:g}', *(['--force'] * self.given.force)]
        words += [w for bag in bags if bag in changes for w in ('--changed', bag, changes[bag])]
        diagnose.run(parser.parse_args(words, Given()))
        return read_json(place / RESULT)

    def _write_experiment(self, place: Path, asked: dict[str, Any]) -> None:
        """Write the experiment for the generator, and as a program where a controller is named."""
        from weld_twin_msgs_py.files.joint_file import write_joint_motion
        from weld_twin_msgs_py.robots import load_robot
        from weld_twin_nodes.offline.output_directory import new_directory

        from ...report.diagnosis_files import RESULT

        given, state = self.given, self.state
        with new_directory(place, mark=EXPERIMENT, force=given.force, shared=True) as made:
            write_joint_motion(made / EXPERIMENT, asked.pop('motion'), asked['sentence'])
            if not given.controller:
                return
            words = dict(word.split('=', 1) for word in state['options'])
            links = (words.get(f'--{name}-link') for name in ('base', 'tip', 'flange'))
            robot = load_robot(state['robot'], *links)
            try:
                given.check_program()
                context = given.program_context(robot, given.controller, str(place / RESULT))
                lines = _program(given, context, made / EXPERIMENT, place / 'experiment')
            except TwinError as error:
                lines = [f'note: no program was written: {error}']
            print('\n'.join(lines))

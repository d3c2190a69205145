# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Which tolerance to tighten, by how much it moves the tool."""

from __future__ import annotations

import json
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING

from weld_twin_core.errors import DataError, ModelError
from weld_twin_nodes.cli.given import Given, say_doubts

from .. import progress

if TYPE_CHECKING:
    from weld_twin_core.arm.robot import Robot
    from weld_twin_core.sensitivity.tolerance import Tolerance

    from ...sensitivity_report import Setting

_WORK = 'weld_twin_report.sensitivity_report.work'
"""What the processes that work need: they import it while this one gets their tasks ready."""


def run(given: Given) -> int:
    """Run the study and say where the page is."""
    from weld_twin_nodes.offline.task_pool import pool_of

    setting = _setting(given)
    if given.figure:
        from ...sensitivity_report import make_figures
        from ...sensitivity_report.study_files import FIGURES, study_directory, study_files

        assert setting is not None
        place = study_directory(given.out)
        with study_files(place, given.force) as made:
            drawings = make_figures(made / FIGURES, setting, given.figure)
        for drawing in drawings:
            print(f'{place / FIGURES / drawing.name}.svg: {drawing.caption}')
        return 0
    from weld_twin_msgs_py.robots import load_robot

    from ...sensitivity_report.study_files import ROBOTS

    robots = [load_robot(name) for name in given.claims_robots or ROBOTS] if given.claims else []
    with (
        closing(pool_of(given.scheduler, given.workers or 0, ahead=_WORK)) as pool,
        progress('starting') as (_, tell),
    ):
        from ...sensitivity_report import make_study

        page = make_study(
            given.out,
            pool,
            setting,
            claims_on=robots,
            tell=tell,
            seed=given.seed,
            force=given.force,
        )
    _print_summary(Path(given.out))
    print(f'page: {page}')
    return 0


def _setting(given: Given) -> Setting | None:
    from weld_twin_core.motion.paths import KINDS, default_seam
    from weld_twin_core.sensitivity import WeldTolerance
    from weld_twin_msgs_py.files.path_file import read_path
    from weld_twin_nodes.offline.given_twin import build_twin

    from ...sensitivity_report import Effort, Setting

    if not given.robot and not given.bag:
        if given.claims and not given.figure:
            return None
        raise DataError('give --robot R or a BAG to study, or --claims')
    twin = build_twin(_robot(given), given.effects_known)
    say_doubts(twin.robot, twin.effects, given.effects_known)
    common = {
        'robot': twin.robot,
        'tolerances': _tolerances(given, twin.robot),
        'known': twin.effects,
        'points': given.points,
        'weld': WeldTolerance(given.across, given.stickout),
        'effort': Effort(
            given.samples, given.runs, given.trajectories, given.placements, given.seed
        ),
    }
    if given.bag:
        return Setting(
            seam=Path(given.bag).name,
            recording=given.read_bag(given.bag, twin.robot),
            normal=given.normal,
            **common,
        )
    if given.path in KINDS:
        return Setting(seam=given.path, path=default_seam(twin.robot, given.path), **common)
    path, torch = read_path(given.path)
    return Setting(seam=Path(given.path).stem, path=path, torch=torch, **common)


def _robot(given: Given) -> Robot:
    import numpy as np

    from weld_twin_core.arm.robot import Robot
    from weld_twin_core.arm.rotation import rotation_matrix, transform

    if given.robot:
        robot = given.load_robot()
    else:
        from weld_twin_msgs_py.bags import provenance  # the readers of bags take their time

        model = provenance(given.bag).get('robot')
        if not isinstance(model, dict):
            raise DataError(f"bag '{given.bag}' holds no robot model; give --robot R")
        robot = Robot.from_mapping(model)
    if given.tool is None:
        return robot
    tool = transform(rotation_matrix(given.tool[3:]), np.array(given.tool[:3]))
    return robot.with_frames(tool=tool)


def _tolerances(given: Given, robot: Robot) -> tuple[Tolerance, ...]:
    from weld_twin_core.sensitivity import default_tolerances, tolerances_from_list
    from weld_twin_msgs_py.files.yaml_file import read_yaml

    if not given.tolerances:
        return default_tolerances(robot)
    try:
        return tolerances_from_list(read_yaml(given.tolerances, 'tolerance file'), robot)
    except ModelError as error:
        raise ModelError(f"tolerance file '{given.tolerances}': {error}") from None


def _print_summary(place: Path) -> None:
    from ...sensitivity_report.study_files import CLAIMS, RESULT
    from ...sensitivity_report.study_page import advised, parameter_words

    if (place / RESULT).is_file():
        for motion, result in json.loads((place / RESULT).read_text())['motions'].items():
            inside = result['global']['stack']['inside']['both']
            rows = result['global']['sobol']['parameter']['d_norm']['indices']
            best = sorted(rows, key=lambda row: -row['ST'])[:3]
            for first in advised(result['local']['parameters'], 1):
                print(
                    f'{motion}: {first.instruction} first: from {first.now} to {first.wanted}, '
                    f'gains {1e3 * first.gain_m:.3f} mm'
                )
            print(
                f'{motion}: what drives the largest deviation: '
                + ', '.join(f'{parameter_words(r["name"])} ({r["ST"]:.2f})' for r in best)
            )
            print(
                f'{motion}: inside the weld tolerance with probability {inside["value"]:.3f} '
                f'({inside["low"]:.3f} to {inside["high"]:.3f})'
            )
    if (place / CLAIMS).is_file():
        for claim in json.loads((place / CLAIMS).read_text())['claims']:
            print(f'{claim["statement"]}: {claim["verdict"]}')

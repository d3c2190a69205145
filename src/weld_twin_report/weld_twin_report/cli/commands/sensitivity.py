# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Which tolerance to tighten, by how much it moves the tool.

For a robot on a seam, or for the motion of a bag. Writes sensitivity.json, indices, figures with
their data and a page to read (sensitivity.html) to the directory; run again, it continues where
it was stopped. --figure draws one figure only; --claims measures the paper's claims on several
robots and seams.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from weld_twin_core.errors import DataError, ModelError
from weld_twin_nodes.cli.main import brought
from weld_twin_nodes.cli.options import ANY_ROBOT, TOPICS, folder_output, robot_of, topics_of

if TYPE_CHECKING:
    from weld_twin_core.arm.robot import Robot
    from weld_twin_core.sensitivity.tolerance import Tolerance

    from ...sensitivity_report import Setting
    from ...sensitivity_report.study_files import Claims

EXAMPLE = 'weld-twin sensitivity --robot ur5 --path spline --out study'
_WORK = 'weld_twin_report.sensitivity_report.work'
"""What the processes that work need: they import it while this one gets their tasks ready."""


OPTIONS = (
    '[BAG]                    study the motion recorded in a bag',
    ANY_ROBOT,
    folder_output('directory for the results'),
    """
what is studied:
--path P                 path file, or line, arc, circle, polyline, spline, weave [default: line]
--tolerances FILE        tolerance file (default: typical sizes of joint_offset, link_length,
                         link_twist, backlash and base_pose)
--effects-known FILE     effects file or diagnosis.json; the twin has these effects from the start
--figure K               draw figure 6 to 14, posture or recorded, and nothing else; may be given again
--claims                 measure the claims of the paper
of the seam, and of the claims:
rare:
--claims-robots R ...    robots of the claims (default: seven builds)
--tool X Y Z RX RY RZ    tool frame in the flange [m, rotation vector rad], instead of the model's
--points N               path points [default: 200]
--across M               weld tolerance across the seam [default: 5e-4]
--stickout M             weld tolerance of the stick-out [default: 1e-3]
--normal X Y Z           direction out of the work, for a recorded motion (default: against the wire)
how much is run, and where:
rare:
--samples N              Sobol base samples, a power of two [default: 1024]
--runs N                 runs of the tolerance stack [default: 20000]
--trajectories N         trajectories of the Morris screening [default: 50]
--placements N           placements tried for the advice [default: 32]
--seed N                 seed of all draws [default: 0]
--workers N              processes (default: one a core)
--scheduler ADDRESS      Dask scheduler to run on instead
""",
    TOPICS,
)


def run(args: argparse.Namespace) -> int:
    """Run the study and say where the page is."""
    from weld_twin_nodes.offline.task_pool import pool_of

    setting = _setting(args)
    if args.figure:
        from ...sensitivity_report import make_figures
        from ...sensitivity_report.study_files import FIGURES, study_directory, study_files

        assert setting is not None
        place = study_directory(args.out)
        with study_files(place, args.force) as made:
            drawings = make_figures(made / FIGURES, setting, args.figure)
        for drawing in drawings:
            print(f'{place / FIGURES / drawing.name}.svg: {drawing.caption}')
        return 0
    claims = _claims(args)
    with (
        closing(pool_of(args.scheduler, args.workers or 0, ahead=_WORK)) as pool,
        _progress() as tell,
    ):
        from ...sensitivity_report import make_study

        page = make_study(
            args.out,
            pool,
            setting,
            claims=claims,
            tell=tell,
            force=args.force,
        )
    _print_summary(Path(args.out))
    print(f'page: {page}')
    return 0


def _setting(args: argparse.Namespace) -> Setting | None:
    from weld_twin_core.motion.paths import KINDS, default_seam
    from weld_twin_core.sensitivity import WeldTolerance
    from weld_twin_msgs_py.files.path_file import read_path
    from weld_twin_nodes.offline.given_twin import build_twin

    from ...sensitivity_report import Effort, Setting

    if not args.robot and not args.bag:
        if args.claims and not args.figure:
            return None
        raise DataError('give --robot R or a BAG to study, or --claims')
    twin = build_twin(_robot(args), args.effects_known)
    common = {
        'robot': twin.robot,
        'tolerances': _tolerances(args, twin.robot),
        'known': twin.effects,
        'points': args.points,
        'weld': WeldTolerance(args.across, args.stickout),
        'effort': Effort(args.samples, args.runs, args.trajectories, args.placements, args.seed),
    }
    if args.bag:
        from weld_twin_msgs_py.bags import read_recording

        return Setting(
            seam=Path(args.bag).name,
            recording=read_recording(args.bag, twin.robot, topics_of(args)),
            normal=args.normal,
            **common,
        )
    if args.path in KINDS:
        return Setting(seam=args.path, path=default_seam(twin.robot, args.path), **common)
    path, torch = read_path(args.path)
    return Setting(seam=Path(args.path).stem, path=path, torch=torch, **common)


def _robot(args: argparse.Namespace) -> Robot:
    import numpy as np

    from weld_twin_core.arm.robot import Robot
    from weld_twin_core.arm.rotation import rotation_matrix, transform

    if args.robot:
        robot = robot_of(args)
    else:
        from weld_twin_msgs_py.bags import provenance  # the readers of bags take their time

        model = provenance(args.bag).get('robot')
        if not isinstance(model, dict):
            raise DataError(f"bag '{args.bag}' holds no robot model; give --robot R")
        robot = Robot.from_mapping(model)
    if args.tool is None:
        return robot
    tool = transform(rotation_matrix(args.tool[3:]), np.array(args.tool[:3]))
    return robot.with_frames(tool=tool)


def _tolerances(args: argparse.Namespace, robot: Robot) -> tuple[Tolerance, ...]:
    from weld_twin_core.sensitivity import default_tolerances, tolerances_from_list
    from weld_twin_msgs_py.files.yaml_file import read_yaml

    if not args.tolerances:
        return default_tolerances(robot)
    try:
        return tolerances_from_list(read_yaml(args.tolerances, 'tolerance file'), robot)
    except ModelError as error:
        raise ModelError(f"tolerance file '{args.tolerances}': {error}") from None


def _claims(args: argparse.Namespace) -> Claims | None:
    """Return what measures the claims of the paper; they are a proof, which another package brings."""
    if not args.claims:
        return None
    study = brought('weld_twin_lab.claims.study', '--claims')
    claims: Claims = study.claims_on(args.claims_robots, args.seed)
    return claims


def _print_summary(place: Path) -> None:
    import json

    from ...sensitivity_report.fitter_words import advised, parameter_words
    from ...sensitivity_report.study_files import CLAIMS, RESULT

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


@contextmanager
def _progress() -> Iterator[Callable[[int, int, str], None]]:
    """Yield where to tell progress; it shows on a terminal and leaves other streams alone."""
    from rich.console import Console
    from rich.progress import MofNCompleteColumn, Progress, TimeElapsedColumn

    console = Console(stderr=True)
    columns = (*Progress.get_default_columns()[:2], MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, disable=not console.is_terminal) as bar:
        task = bar.add_task('starting', total=None)
        yield lambda done, total, label: bar.update(
            task, completed=done, total=total, description=label
        )

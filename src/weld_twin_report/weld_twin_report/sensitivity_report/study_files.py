# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A study run, and its files, each written whole; one that was stopped finds its results again."""

from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

from weld_twin_core import __version__
from weld_twin_core.arm.robot import Robot
from weld_twin_core.errors import DataError
from weld_twin_core.sensitivity import Tolerance
from weld_twin_msgs_py.files import markdown
from weld_twin_msgs_py.files.csv_text import csv_text
from weld_twin_msgs_py.files.whole_files import write_json, write_text
from weld_twin_msgs_py.files.yaml_file import yaml_text
from weld_twin_nodes.offline.output_directory import new_directory
from weld_twin_nodes.offline.task_pool import Pool, Runner, Task, Tell

from .figures import Drawing, draw, drawable
from .setting import Setting
from .study_page import study_page
from .work import claim_case, run_study

ROBOTS = (
    'ur5',
    'ur10',
    'kuka_kr6_r900',
    'abb_irb120',
    'abb_irb1600',
    'fanuc_m10ia',
    'franka_panda',
)
"""One of each kind of build: the verdicts of `docs/claims.md` were measured on them."""
SEAMS = ('line', 'arc', 'polyline')
RESULT, CLAIMS, PAGE = 'sensitivity.json', 'claims.json', 'sensitivity.html'
TASKS, FIGURES = 'tasks', 'figures'


def study_directory(path: Path | str) -> Path:
    """Return the directory of a study, with a place for the results of its tasks."""
    place = Path(path)
    if place.exists() and not place.is_dir():
        raise DataError(f"'{place}' is a file; choose another place")
    ours = any((place / name).exists() for name in (TASKS, RESULT, CLAIMS))
    if place.is_dir() and any(place.iterdir()) and not ours:
        raise DataError(f"'{place}' holds something else already; choose another place")
    try:
        (place / TASKS).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise DataError(f"'{place}' cannot be written: {error.strerror}") from None
    return place


def write_study(place: Path, result: dict[str, Any], tolerances: Sequence[Tolerance]) -> None:
    """Write the results of a study, its tolerances and its indices."""
    entries = [tolerance.to_mapping() for tolerance in tolerances]
    write_text(place / 'tolerances.yaml', yaml_text(entries), overwrite=True)
    header = ('motion', 'by', 'output', 'name', 'S1', 'S1_half', 'ST', 'ST_half')
    write_text(place / 'indices.csv', csv_text(header, _indices(result)), overwrite=True)
    write_json(place / RESULT, {**result, 'version': __version__}, overwrite=True)


def write_claims(place: Path, result: dict[str, Any]) -> None:
    """Write the claims table in every form, and the measurements behind it."""
    heads = ['claim', 'statement', 'where', 'verdict', 'held', 'cases', 'reason']
    cases = result['cases']
    for name, keys, rows in (
        ('claims.csv', heads, result['claims']),
        ('claims-cases.csv', list(cases[0]), cases),
    ):
        text = csv_text(keys, ([row.get(key, '') for key in keys] for row in rows))
        write_text(place / name, text, overwrite=True)
    write_text(place / 'claims.md', claims_markdown(result), overwrite=True)
    write_json(place / CLAIMS, {**result, 'version': __version__}, overwrite=True)


def _indices(result: dict[str, Any]) -> Iterator[list[Any]]:
    """Yield every index of every motion, grouping and output, a row each."""
    for motion, outcome in result['motions'].items():
        for by, outputs in outcome['global']['sobol'].items():
            for output, indices in outputs.items():
                for row in indices['indices']:
                    values = [row[key] for key in ('name', 'S1', 'S1_half', 'ST', 'ST_half')]
                    yield [motion, by, output, *values]


def make_study(
    out: Path | str,  # directory of the results; one that was begun is continued
    pool: Pool,  # where tasks run
    setting: Setting | None,  # left out, only the claims are studied
    *,
    claims_on: Sequence[Robot] = (),  # robots the claims are measured on; none for no claims
    seams: Sequence[str] = SEAMS,  # bundled seams the claims are measured on
    tell: Tell | None = None,  # called after every task
    seed: int = 0,  # of the claims
    force: bool = False,  # as `new_directory` takes it
) -> Path:
    """Run a study, the claims, or both, write the results and return the page."""
    place = study_directory(out)
    drawings: list[Drawing] = []
    with study_files(place, force) as made:

        def draw_all() -> None:
            assert setting is not None
            drawings.extend(make_figures(made / FIGURES, setting, drawable(setting)))

        with Runner(pool, place / TASKS, tell) as runner:
            study = None if setting is None else run_study(setting, runner, draw_all)
            claims = run_claims(runner, claims_on, seams, seed) if claims_on else None
        if setting is not None and study is not None:
            write_study(made, study, setting.tolerances)
        if claims is not None:
            write_claims(made, claims)
        write_text(made / PAGE, study_page(study, claims, drawings))
    return place / PAGE


def study_files(place: Path, force: bool) -> AbstractContextManager[Path]:
    """Return where to make files of a study; those that it has already, and does not make, stay."""
    return new_directory(place, mark=PAGE, force=force, adds=True, shared=True)


def make_figures(place: Path, setting: Setting, keys: Sequence[str]) -> list[Drawing]:
    """Draw figures and write them with their data."""
    result = [draw(setting, key) for key in keys]
    drawings = [drawing for drawing in result if drawing is not None]
    for drawing in drawings:
        write_text(place / f'{drawing.name}.svg', drawing.svg, overwrite=True)
        write_text(place / f'{drawing.name}.csv', drawing.csv, overwrite=True)
    return drawings


def run_claims(
    runner: Runner, robots: Sequence[Robot], seams: Sequence[str] = SEAMS, seed: int = 0
) -> dict[str, Any]:
    """Return the claims with their verdicts, and what was measured on every case."""
    from weld_twin_core.sensitivity.claims import CaseName, judge

    names = [CaseName(robot.name, seam) for robot in robots for seam in seams]
    tasks = [
        Task(claim_case, (robot, seam, seed), f'claims: {robot.name}, {seam}')
        for robot in robots
        for seam in seams
    ]
    result = dict(zip(names, runner.run(tasks), strict=True))
    return {
        'schema': 'weld_twin/claims/1',
        'seed': seed,
        'robots': [robot.name for robot in robots],
        'seams': list(seams),
        'claims': [claim.as_dict() for claim in judge(result)],
        'cases': [{**name._asdict(), **measured} for name, measured in result.items()],
    }


def claims_markdown(result: dict[str, Any]) -> str:
    rows = [('Claim', 'In the paper', 'Holds as written', 'Verdict', 'Why, as measured')]
    for c in result['claims']:
        share = f'{c["held"]} of {c["cases"]}'
        rows.append((c['statement'], c['where'], share, f'**{c["verdict"]}**', c['reason']))
    return (
        f'Measured on {len(result["robots"])} robots ({", ".join(result["robots"])}) and '
        f'{len(result["seams"])} seams ({", ".join(result["seams"])}) each.\n\n'
        # The bars of a norm would end a cell.
        + markdown.table(*([cell.replace('|', '‖') for cell in row] for row in rows))
    )

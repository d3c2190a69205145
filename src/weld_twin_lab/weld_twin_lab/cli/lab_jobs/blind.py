# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Check the diagnosis on recordings whose causes are withheld from it.

Cases come from a simulator that shares no formula with the twin. Their truths are sealed before
any diagnosis, and opened when the verdicts are in.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from weld_twin_core.errors import DataError
from weld_twin_nodes.cli.given import Given
from weld_twin_nodes.cli.parsing import Command, add_command

from ...study import (
    DONE,
    Study,
    kept_of_engine,
    listed,
    options,
    require_simulator,
    study,
)

DRAW = """
--cases N         how many [default: 400]
--seed N, required  decides the cases
--kinds LIST      only these, comma-separated: single, double, triple, none, outside, withheld, ambiguous
--leave-one-out   each family of effects in turn at work and taken out of the library
--seconds MIN,MAX  duration of a recording [default: 20,60]
"""
CASES = 'CASES  cases made by blind make'
TRUTHS = '--truths DIR, required  where the truths go; keep it where a diagnosis cannot read'
DIAGNOSE = """
--allow-readable   go on although truths lie within reach; the score tells
--without-holdout  judge the shrink on stretches of the training recording
"""
SCORE = """
--truths DIR, required   their truths
--results DIR, required  verdicts of blind diagnose
--seal HASH              the seal as it was printed before the diagnosis
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the jobs, each with its options."""
    places = parser.add_subparsers(required=True, metavar='JOB', dest='job')
    for name, (add, command) in JOBS.items():
        add_command(places, name, Command(str(command.__doc__), options=add))


def run(args: Given) -> int:
    """Run the job."""
    return JOBS[args.job][1](args)


@study
def make(study: Study) -> None:
    """Make cases and seal their truths.

    Prints the seal, a hash over all cases and truths; publish it before anybody diagnoses.
    """
    _made(study, study.out, Path(study.args.truths))


@study
def diagnose(study: Study) -> None:
    """Diagnose cases from their recordings alone.

    Refuses to run where the truths could be read. Stopped, it goes on where it was when run again.
    """
    from ...blind.diagnosing import diagnose_cases

    args = study.args
    with study.runner('diagnosing') as runner:
        verdicts = diagnose_cases(
            Path(args.cases),
            study.out,
            runner,
            allow_readable=args.allow_readable,
            with_holdout=not args.without_holdout,
        )
    failed = sum(verdict['error'] is not None for verdict in verdicts)
    print(f'{len(verdicts) - failed} verdicts, {failed} cases could not be diagnosed')


@study
def score(study: Study) -> None:
    """Open the seals and score the verdicts.

    Exits with 2 when a case, a truth or the list of them is not what was sealed.
    """
    args = study.args
    _scored(study, Path(args.cases), Path(args.truths), Path(args.results), args.seal)


@study
def whole(study: Study) -> None:
    """Make, diagnose and score in one go.

    The truths lie beside the cases then; nothing but the code keeps the diagnosis from reading them.
    """
    from ...blind.diagnosing import diagnose_cases

    cases, truths, results = (study.out / name for name in ('cases', 'truths', 'verdicts'))
    _made(study, cases, truths)
    with study.runner('diagnosing', kept_of_engine(results)) as runner:
        diagnose_cases(cases, results, runner, allow_readable=True)
    _scored(study, cases, truths, results)


JOBS = {
    'make': (options(DRAW, TRUTHS, out='where the recordings go', pool=True), make),
    'diagnose': (options(CASES, DIAGNOSE, out='where the verdicts go', pool=True), diagnose),
    'score': (options(CASES, SCORE, out='where score.json and score.md go'), score),
    'run': (options(DRAW, out='where everything goes', pool=True), whole),
}
"""The jobs: their options, and what runs them."""


def _made(study: Study, cases: Path, truths: Path) -> None:
    """Make the cases that the options ask for, and print their seal."""
    require_simulator()
    from ...blind.making import make

    args = study.args
    kinds = ('withheld',) if args.leave_one_out else tuple(listed(args.kinds))
    spans = _spans(args.seconds)
    with study.runner('making cases', truths / DONE) as runner:
        sealed = make(cases, truths, args.seed, args.cases, runner, kinds, spans)
    print(f'seal {sealed}', flush=True)


def _scored(study: Study, cases: Path, truths: Path, results: Path, seal: str = '') -> None:
    """Score, write, and print the measures."""
    from ...blind.scoring import page, score

    result = score(cases, truths, results, seal_given=seal)
    study.write('score', result, page(result))


def _spans(seconds: str) -> tuple[float, float]:
    """Return the shortest and longest duration [s]."""
    try:
        low, high = map(float, seconds.split(','))
    except ValueError:
        low = high = 0.0
    if not 5.0 <= low <= high <= 600.0:
        raise DataError(f'--seconds takes two durations of 5 to 600 s, got {seconds!r}')
    return low, high

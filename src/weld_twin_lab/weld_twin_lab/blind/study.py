# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The jobs of the blind check: make, diagnose and score, one after the other or apart."""

from __future__ import annotations

from pathlib import Path

from weld_twin_core.errors import DataError

from ..study import DONE, Study, kept_of_engine, listed, require_simulator
from .diagnosing import diagnose_cases


def make(study: Study) -> None:
    _made(study, study.out, Path(study.args.truths))


def diagnose(study: Study) -> None:
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


def score(study: Study) -> None:
    args = study.args
    _scored(study, Path(args.cases), Path(args.truths), Path(args.results), args.seal)


def whole(study: Study) -> None:
    cases, truths, results = (study.out / name for name in ('cases', 'truths', 'verdicts'))
    _made(study, cases, truths)
    with study.runner('diagnosing', kept_of_engine(results)) as runner:
        diagnose_cases(cases, results, runner, allow_readable=True)
    _scored(study, cases, truths, results)


def _made(study: Study, cases: Path, truths: Path) -> None:
    require_simulator()
    from .making import make  # not beside a diagnosis

    args = study.args
    kinds = ('withheld',) if args.leave_one_out else tuple(listed(args.kinds))
    spans = _spans(args.seconds)
    with study.runner('making cases', truths / DONE) as runner:
        sealed = make(cases, truths, args.seed, args.cases, runner, kinds, spans)
    print(f'seal {sealed}', flush=True)


def _scored(study: Study, cases: Path, truths: Path, results: Path, seal: str = '') -> None:
    from .scoring import page, score

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

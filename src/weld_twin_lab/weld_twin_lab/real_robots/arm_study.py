# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Every split diagnosed by the ordinary engine, judged on its held-out poses, and written down."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from weld_twin_core import __version__
from weld_twin_msgs_py.files.input_files import hashed
from weld_twin_msgs_py.files.whole_files import write_text
from weld_twin_report.report.diagnosis_files import diagnosis_text
from weld_twin_report.report.family_table import ripples

from .arm_page import robot_page
from .data import Source, tables, ur5_splits, ur10_splits
from .judged_split import Judged, judge

RESULTS = 'results.json'
SPLITS = {'ur5': ur5_splits, 'ur10': ur10_splits}


def judged_arms(
    ur5: Path, ur10: Path, out: Path, tell: Callable[[str], None] = lambda text: None
) -> dict[str, Any]:
    """
    Diagnose both arms on every split and write pages and results to a directory.

    Parameters
    ----------
    ur5, ur10 : Path
        Directories with the published tables.
    out : Path
        Exists and is empty.
    tell : callable
        Told what is being done.

    Raises
    ------
    DataError
        A table is missing or cannot be read.

    """
    results: dict[str, Any] = {'version': __version__, 'robots': {}}
    for robot, directory in (('ur5', ur5), ('ur10', ur10)):
        sources = tables(robot, directory)
        judged = list(_judged(robot, sources, tell))
        for each in judged:
            write_text(out / f'{each.split.name}.json', diagnosis_text(each.diagnosis, ()))
        write_text(out / f'{robot}.html', robot_page(robot, sources, judged))
        results['robots'][robot] = _entry(sources, judged)
    write_text(out / RESULTS, json.dumps(results, indent=1, allow_nan=False) + '\n')
    return results


def _judged(
    robot: str, sources: tuple[Source, ...], tell: Callable[[str], None]
) -> Iterator[Judged]:
    for split in SPLITS[robot](sources):
        yield judge(split, lambda text, name=split.name: tell(f'{name}: {text}'))  # type: ignore[misc]


def _entry(sources: tuple[Source, ...], judged: list[Judged]) -> dict[str, Any]:
    return {
        'tables': [
            {
                'name': s.path.name,
                'sha256': hashed('table', s.path).sha256,
                'assumptions': list(s.assumptions),
            }
            for s in sources
        ],
        'splits': {each.split.name: _split(each) for each in judged},
    }


def _split(judged: Judged) -> dict[str, Any]:
    diagnosis, goal = judged.diagnosis, judged.split.goal
    return {
        'what': judged.split.title,
        'goal': goal._asdict(),
        'frames_only': judged.before.as_dict(),
        'got': judged.after.as_dict(),
        'reached': judged.reached,
        'claimed': {
            'ratio': diagnosis.shrink.ratio,
            'ci95': list(diagnosis.shrink.ci95),
            'rms_after_m': diagnosis.shrink.rms_after_m,
        },
        'achieved_ratio': judged.after.rms_m / judged.before.rms_m,
        'inside_claim': judged.within,
        'noise_floor_m': diagnosis.gap.noise_floor_m,
        'status': diagnosis.status,
        'confidence': diagnosis.confidence,
        'waterfall': [{'added': n, 'rms_m': v} for n, v in diagnosis.shrink.steps],
        'families': [
            {'effect': f.effect, 'named': f.named, 'rms_m': f.rms_m} for f in diagnosis.families
        ],
        'ripple': [
            {
                'joint': r.joint,
                'rms_rad': r.rms,
                'strongest': [{'order': n, 'amplitude_rad': a} for n, a in r.lines],
            }
            for r in ripples(diagnosis)
        ],
        'seconds': round(judged.seconds, 1),
    }

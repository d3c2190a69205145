# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Check the diagnosis on recordings whose causes are withheld from it.

Cases come from a simulator that shares no formula with the twin. Their truths are sealed before
any diagnosis, and opened when the verdicts are in.
"""

from __future__ import annotations

import argparse
from importlib import import_module
from types import ModuleType

from weld_twin_nodes.cli.options import add_command

JOBS = ('make', 'diagnose', 'score', 'run', 'semi-real', 'recovery')


def _job(name: str) -> ModuleType:
    return import_module(f'weld_twin_lab.cli.blind_jobs.{name.replace("-", "_")}')


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the jobs, each with its options."""
    places = parser.add_subparsers(required=True, metavar='JOB', dest='job')
    for name in JOBS:
        add_command(places, name, _job(name))


def run(args: argparse.Namespace) -> int:
    """Run the job."""
    return int(_job(args.job).run(args))

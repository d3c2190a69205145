# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Many cells: their recordings diagnosed side by side into one database, and a page that ranks them."""

from __future__ import annotations

import argparse
from importlib import import_module

from weld_twin_nodes.cli.options import add_command

JOBS = ('run', 'page')


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the jobs, each with its options."""
    jobs = parser.add_subparsers(required=True, metavar='JOB', dest='job')
    for name in JOBS:
        add_command(jobs, name, import_module(f'weld_twin_report.cli.fleet_jobs.{name}'))


def run(args: argparse.Namespace) -> int:
    """Run the job."""
    return int(import_module(f'weld_twin_report.cli.fleet_jobs.{args.job}').run(args))

# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The history of a cell: its diagnoses over time, what changed since when, and where it leads."""

from __future__ import annotations

import argparse
from importlib import import_module

from weld_twin_nodes.cli.options import add_command

JOBS = ('add', 'show', 'changed')


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the jobs, each with its options."""
    jobs = parser.add_subparsers(required=True, metavar='JOB', dest='job')
    for name in JOBS:
        add_command(jobs, name, import_module(f'weld_twin_report.cli.history_jobs.{name}'))


def run(args: argparse.Namespace) -> int:
    """Run the job."""
    return int(import_module(f'weld_twin_report.cli.history_jobs.{args.job}').run(args))

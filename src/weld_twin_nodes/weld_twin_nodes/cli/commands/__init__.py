# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Commands, a module each; `..main` names them.

A module has a docstring, whose first line is what the list of commands says of it, an ``EXAMPLE``
that can be typed, ``OPTIONS``, which are tables as `..parsing` reads them, and a function::

    def run(args: argparse.Namespace) -> int: ...

`run` returns the exit code and raises `weld_twin_core.errors.TwinError` for anything the user
can mend. Modules import what is slow to import (numpy, rclpy, matplotlib) inside functions. A command
with several jobs has a function for each, marked by `job`, in ``JOBS``. Options that few need are rare:
`--help` fits on one screen without them.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable

from ..parsing import Options

Run = Callable[[argparse.Namespace], int]


def job(example: str, *options: Options) -> Callable[[Run], Run]:
    """Mark what runs a job of a command with an example and its options; its docstring is the help."""

    def marked(run: Run) -> Run:
        vars(run).update(EXAMPLE=example, OPTIONS=options)
        return run

    return marked


def jobs(*runs: Run) -> dict[str, Run]:
    """Return the jobs of a command by their names."""
    return {run.__name__: run for run in runs}

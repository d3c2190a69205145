# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Commands, a module each; `..main` names them.

A module has a docstring, whose first line is what the list of commands says of it, an ``EXAMPLE``
that can be typed, ``OPTIONS``, which are tables as `..parsing` reads them, and a function::

    def run(args: argparse.Namespace) -> int: ...

`run` returns the exit code and raises `weld_twin_core.errors.TwinError` for anything the user
can mend. Modules import what is slow to import (numpy, rclpy, matplotlib) inside functions. A command
with several jobs has them in ``JOBS``, as `job` makes them. Options that few need are rare: `--help`
fits on one screen without them.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from types import SimpleNamespace

from ..parsing import Options


def job(
    run: Callable[[argparse.Namespace], int], example: str, *options: Options
) -> SimpleNamespace:
    """Return a job of a command; its help is the docstring of what runs it."""
    return SimpleNamespace(__doc__=run.__doc__, run=run, EXAMPLE=example, OPTIONS=options)

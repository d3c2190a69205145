# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Commands: a module each, or a folder with a module for each job; `..main` names them.

A module has a docstring, whose first line is what the list of commands says of it, an ``EXAMPLE`` that
can be typed, and two functions::

    def add_arguments(parser: argparse.ArgumentParser) -> None: ...
    def run(args: argparse.Namespace) -> int: ...

`run` returns the exit code and raises `weld_twin_core.errors.TwinError` for anything the user
can mend. Modules import what is slow to import (numpy, rclpy, matplotlib) inside `run`. Options that
few need are added as rare: `--help` fits on one screen without them.
"""

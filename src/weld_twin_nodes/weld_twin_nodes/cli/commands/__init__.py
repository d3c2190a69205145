# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Subcommands, found by their file names.

An underscore is a hyphen, a trailing one keeps a name off Python's keywords.

A module here has a docstring, whose first line is the help text, and two functions::

    def add_arguments(parser: argparse.ArgumentParser) -> None: ...
    def run(args: argparse.Namespace) -> int: ...

`run` returns the exit code and raises `weld_twin_core.errors.TwinError` for anything the user
can mend. Modules import what is slow to import (numpy, rclpy, matplotlib) inside `run`.
"""

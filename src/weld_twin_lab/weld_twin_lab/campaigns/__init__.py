# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Long trials of robustness whose results are kept under version control.

Each module of this package is a campaign; what a campaign needs beside it lies in a sub-package.
A campaign has a docstring, whose first line is the help text, and three functions::

    def add_arguments(parser: argparse.ArgumentParser) -> None: ...
    def run(args: argparse.Namespace, tell: Callable[[str], None]) -> dict[str, Any]: ...
    def table(result: dict[str, Any]) -> str: ...

`run` returns plain JSON values, among them ``passed`` (bool); `tell` prints a line of progress.
`table` says the result at a glance, in Markdown; docs/robustness.md shows those of the kept ones.
Modules import what is slow to import (numpy, rclpy) inside `run`.
"""

from pkgutil import iter_modules


def names() -> list[str]:
    """Return the campaigns there are."""
    return sorted(module.name for module in iter_modules(__path__) if not module.ispkg)

# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The command line run in this process, as a test or a notebook wants it."""

from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from typing import NamedTuple

from .main import main


class Said(NamedTuple):
    """Exit code of a command, and what it printed on its two streams."""

    code: int
    out: str
    err: str


def weld_twin(*words: object) -> Said:
    """Run ``weld-twin`` with the words given, in this process, and return what it said."""
    out, err = StringIO(), StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        try:
            code = main([str(word) for word in words])
        except SystemExit as stop:  # argparse ends like this
            code = stop.code if isinstance(stop.code, int) else 1
    return Said(code, out.getvalue(), err.getvalue())

# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The command line in this process, with what it prints."""

from __future__ import annotations

from typing import NamedTuple

import pytest

from weld_twin_nodes.cli import main


class Result(NamedTuple):
    code: int
    out: str
    err: str


@pytest.fixture
def weld_twin(capsys):
    """Return a function that runs the command line and returns exit code and output."""

    def run(*words) -> Result:
        try:
            code = main([str(word) for word in words])
        except SystemExit as stop:
            code = stop.code
        return Result(code, *capsys.readouterr())

    return run

# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""`python -m weld_twin_lab.contest ENTRANT`: answers of one of the entrants; see `serve`."""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path

from .open_form import read_case, write_answer
from .processes import serve

entrant = import_module(f'{__package__}.entrants.{sys.argv[1]}')


def _answered(case: Path, out: Path) -> None:
    write_answer(out, entrant.answer(read_case(case)))


serve(_answered)

# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""`python -m weld_twin_lab.contest ENTRANT CASE OUT`: the answer of one of the entrants."""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path

from .open_form import read_case, write_answer

name, case, out = sys.argv[1:]
entrant = import_module(f'{__package__}.entrants.{name}')
write_answer(Path(out), entrant.answer(read_case(Path(case))))

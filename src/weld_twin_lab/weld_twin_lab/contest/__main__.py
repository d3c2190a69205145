# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""`python -m weld_twin_lab.contest ENTRANT CASE OUT`: the answer of one of the entrants."""

from __future__ import annotations

import sys
from pathlib import Path

from .course import read_case, write_answer
from .entrants import entrant

name, case, out = sys.argv[1:]
write_answer(Path(out), entrant(name)(read_case(Path(case))))

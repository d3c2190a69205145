# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""`python -m weld_twin_lab.contest ENTRANT CASE ANSWER`: the answer of one of the entrants."""

from __future__ import annotations

import sys
from pathlib import Path

from .case import case_at, put
from .entrants import entrant

name, case, answer = sys.argv[1:]
put(Path(answer), entrant(name)(case_at(Path(case))))

# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Learn from investigated cells how far to believe what two diagnoses name beside each other.

Reads tables that `weld-twin lab investigate` wrote, and prints the weights of the rule that closes
a question, with what they are worth on cells that they were not learned from.
"""

from __future__ import annotations

import json
from pathlib import Path

from ...study import Study, options, study

OPTIONS = options('TABLES ...  investigate.json of cells to learn from', out='')


@study
def run(study: Study) -> None:
    """Learn, and print the page."""
    from weld_twin_core.errors import DataError

    from ...experiments.closing_weights import heard, page

    cases = []
    for table in map(Path, study.args.tables):
        try:
            cases += json.loads(table.read_text(encoding='utf-8'))['cases']
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise DataError(f"'{table}' is no table of investigated cells: {error}") from None
    all_ = heard(cases)
    if not len(all_.right):
        raise DataError('none of the cells has two diagnoses of the same round; give other tables')
    print(page(all_), end='')

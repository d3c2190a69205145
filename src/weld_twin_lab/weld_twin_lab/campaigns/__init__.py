# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Long trials of robustness whose results are kept under version control.

A campaign is a row of the table in `cli/lab.py`, and a module of its name with::

    def run(args: Given, tell: Callable[[str], None]) -> dict[str, Any]: ...
    def table(result: dict[str, Any]) -> str: ...

`run` returns plain JSON values, among them ``passed`` (bool); `tell` prints a line of progress.
`table` says the result at a glance, in Markdown; docs/robustness.md shows those of the kept ones.
"""

from __future__ import annotations

import json
import os
import platform
import time
from collections.abc import Mapping
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import Any

from weld_twin_core import __version__
from weld_twin_core.errors import DataError
from weld_twin_msgs_py.files.whole_files import read_json, write_text

from ..study import Study

SCHEMA = 'weld_twin/campaign/1'


def run(study: Study) -> bool:
    args, name = study.args, str(study.args.job)
    refuse_foreign(args.out, name)
    module = import_module(f'{__name__}.{name}')
    begin = time.monotonic()
    result: dict[str, Any] = module.run(args, lambda line: print(line, flush=True))
    write_result(args.out, name, time.monotonic() - begin, result)
    print(module.table(result))
    print(f'{name}: {"passed" if result["passed"] else "FAILED"}, {args.out}')
    return bool(result['passed'])


def write_result(
    path: Path | str, campaign: str, seconds: float, result: Mapping[str, Any]
) -> None:
    """Write what came of a campaign, and with what it ran; raises DataError as `refuse_foreign` does."""
    refuse_foreign(path, campaign)
    head = {
        'schema': SCHEMA,
        'campaign': campaign,
        'version': __version__,
        'machine': {
            'python': platform.python_version(),
            'system': platform.system(),
            'architecture': platform.machine(),
            'cores': os.cpu_count(),
        },
        'seconds': round(seconds, 1),
    }
    write_text(path, json.dumps({**head, **result}, indent=1) + '\n', overwrite=True)


def refuse_foreign(path: Path | str, campaign: str) -> None:
    """Raise DataError where anything is but an older result of the same campaign."""
    target = Path(path)
    if not target.exists():
        return
    with suppress(DataError):
        content = read_json(target)
        if (content.get('schema'), content.get('campaign')) == (SCHEMA, campaign):
            return
    raise DataError(f"'{target}' holds something else already; choose another file")

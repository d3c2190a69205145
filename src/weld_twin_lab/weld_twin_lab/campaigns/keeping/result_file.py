# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Result files of the campaigns."""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from weld_twin_core import __version__
from weld_twin_core.errors import DataError
from weld_twin_msgs_py.files.whole_files import write_text

SCHEMA = 'weld_twin/campaign/1'


def write_result(
    path: Path | str, campaign: str, seconds: float, result: Mapping[str, Any]
) -> None:
    """
    Write what came of a campaign, beside where and with what it ran.

    Raises DataError: the file is something else's, or cannot be written.
    """
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
    """
    Refuse to replace anything but an older result of the same campaign.

    Raises DataError: something else is there.
    """
    target = Path(path)
    if not target.exists():
        return
    try:
        found = json.loads(target.read_text(encoding='utf-8'))
        ours = (found['schema'], found['campaign']) == (SCHEMA, campaign)
    except (OSError, ValueError, LookupError, TypeError):
        ours = False
    if not ours:
        raise DataError(f"'{target}' holds something else already; choose another file")

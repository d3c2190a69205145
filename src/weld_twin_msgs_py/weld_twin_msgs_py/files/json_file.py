# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Results as JSON: whole or not at all, and null for what is not a finite number."""

from __future__ import annotations

import json
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from weld_twin_core.errors import DataError

from .whole_files import write_text


def plain(value: Any) -> Any:
    """Return a value with lists for arrays, texts for keys, and None for what is not finite."""
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [plain(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not isfinite(value) else value


def json_text(value: Any) -> str:
    """Return the text of a result."""
    return json.dumps(plain(value), indent=1, allow_nan=False) + '\n'


def write_json(path: Path | str, value: Any, *, overwrite: bool = False) -> None:
    """Write a result as `write_text` writes a text."""
    write_text(path, json_text(value), overwrite=overwrite)


def read_json(path: Path | str) -> dict[str, Any]:
    """
    Return the mapping that a file holds.

    Raises DataError: it cannot be read, or holds something else.
    """
    try:
        content = json.loads(Path(path).read_text(encoding='utf-8'))
    except OSError as error:
        raise DataError(f"'{path}' cannot be read: {error.strerror}") from None
    except (ValueError, RecursionError) as error:
        raise DataError(f"'{path}' is not JSON: {error}") from None
    if not isinstance(content, dict):
        raise DataError(f"'{path}' is not what it should be: it holds no names and values")
    return content

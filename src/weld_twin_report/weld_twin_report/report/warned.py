# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""An action as markup: what a reader is told not to do stands out."""

from __future__ import annotations

import re

from .html import Child, tag

_DEGREES = re.compile(r'(?<=\d) deg\b')
_NOT = re.compile(
    r'((?:Do not correct programs|Not this alone)\b[^.]*(?:\.\d[^.]*)*\.'
    r'|Its curve [^.]*: do not correct programs by it\.)'
)
"""What a reader is told not to do."""


def warned(reported: str) -> list[Child]:
    """Return an action as markup: what not to do stands out, and degrees have their sign."""
    parts = _NOT.split(_DEGREES.sub('°', reported))
    return [tag('strong', text) if k % 2 else text for k, text in enumerate(parts) if text]

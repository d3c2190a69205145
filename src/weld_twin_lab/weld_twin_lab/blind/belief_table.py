# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The table of what hangs on each belief."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from weld_twin_msgs_py.files import markdown

HEAD = (
    'belief',
    'acts in',
    'value',
    'moved to',
    'verdicts that change',
    'confidence moves by up to',
    'right',
    'sure and wrong',
)


def table(result: Mapping[str, Any]) -> str:
    """Return the whole in Markdown."""
    late, early = result['usual']['verdict'], result['usual']['others']
    rows = [
        (
            row['belief'],
            row['step'],
            f'{row["value"]:g}',
            f'{row["moved_to"]:g}',
            f'{row["verdicts"]} of {row["cases"]}',
            f'{row["confidence"]:.3f}',
            str(row['right']),
            str(row['sure_and_wrong']),
        )
        for row in result['rows']
    ]
    move = round(100 * result['move'])
    intro = (
        f'Every belief of a diagnosis, moved by {move} % down and up, one at a time. The cases '
        f'are sealed under `{result["seal"][:16]}`. Beliefs that act in the verdict are decided '
        f'anew on {late["cases"]} cases, of which {late["right"]} are right and '
        f'{late["sure_and_wrong"]} sure and wrong as the beliefs stand.'
    )
    if early['cases']:
        intro += (
            f' The others need new fits, made on {early["cases"]} of these cases, of which '
            f'{early["right"]} are right and {early["sure_and_wrong"]} sure and wrong.'
        )
    return f'{intro}\n\n{markdown.table(HEAD, *rows)}\n'

# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The JSON Schema of a robot, effects, seam or artefact file."""

from __future__ import annotations

import argparse

from ...options import add_file_output, output_file
from ...parsing import Adder

EXAMPLE = 'weld-twin export schema robot --out robot.schema.json'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    Adder(parser)('kind', 'KIND', 'robot, effects, seam or artefact')
    add_file_output(parser, 'file to write (default: print it)')


def run(args: argparse.Namespace) -> int:
    """Write or print the schema."""
    import json

    from weld_twin_core.errors import DataError
    from weld_twin_msgs_py.files.schemas import NAMES, schema
    from weld_twin_msgs_py.files.whole_files import write_text

    if args.kind not in NAMES:
        raise DataError(f'there is no schema {args.kind!r}; there are {", ".join(NAMES)}')
    text = json.dumps(schema(args.kind), indent=1) + '\n'
    if args.out is None:
        print(text, end='')
    else:
        with output_file(args) as path:
            write_text(path, text)
    return 0

# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Write the security policy of the nodes, for SROS2.

Each node may publish, hear, answer and ask what it does, and nothing else. Give the namespace and
the remaps that the nodes are started with.
"""

from __future__ import annotations

import argparse

from ...options import add_file_output, output_file
from ...parsing import Adder

EXAMPLE = (
    'weld-twin export policy --namespace left --remap joint_states:=/cell/states --out left.xml'
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    add = Adder(parser)
    add('--namespace', 'NS', 'namespace of the nodes', default='')
    text = 'a name the nodes have and the one they get; may be given again'
    add('--remap', 'FROM:=TO', text, many=True)
    add('--nodes', 'NODE', 'nodes it is for (default: all)', nargs='+', default=[])
    add_file_output(parser, 'file to write (default: print it)')


def run(args: argparse.Namespace) -> int:
    """Write or print the policy."""
    from weld_twin_core.errors import DataError
    from weld_twin_msgs_py.files.whole_files import write_text

    from ....live.policy import policy

    remaps = {}
    for text in args.remap:
        name, mark, to = text.partition(':=')
        if not (mark and name and to):
            raise DataError(f"--remap takes FROM:=TO, got '{text}'")
        remaps[name] = to
    text = policy(args.namespace, remaps, args.nodes)
    if args.out is None:
        print(text, end='')
        return 0
    with output_file(args) as path:
        write_text(path, text)
    print(f'{args.out}: policy for {", ".join(args.nodes) or "all nodes"}')
    return 0

# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Run a proof: what weld_twin claims, one command each.

The proofs that have a command of their own (benchmark, blind, campaign, real-robots) answer here
too.
"""

from __future__ import annotations

import argparse
from importlib import import_module
from pkgutil import iter_modules

from weld_twin_nodes.cli.options import add_command

from . import lab_jobs

OLDER = ('benchmark', 'blind', 'campaign', 'real_robots')
"""Proofs that are commands themselves, modules of this package."""


def proofs() -> dict[str, str]:
    """Return the module of every proof by the name the command line has for it."""
    package = __name__.rpartition('.')[0]
    found = [f'{package}.{name}' for name in OLDER]
    found += [f'{lab_jobs.__name__}.{module.name}' for module in iter_modules(lab_jobs.__path__)]
    return {name.rpartition('.')[2].rstrip('_').replace('_', '-'): name for name in sorted(found)}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the proofs, each with its options."""
    subparsers = parser.add_subparsers(
        required=True, metavar='PROOF', dest='proof', title='proofs'
    )
    for name, path in sorted(proofs().items()):
        module = import_module(path)
        add_command(subparsers, name, module)


def run(args: argparse.Namespace) -> int:
    """Run the proof."""
    return int(import_module(proofs()[args.proof]).run(args))

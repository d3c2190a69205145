# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Run a proof: what weld_twin claims, one command each."""

from __future__ import annotations

import argparse
from importlib import import_module
from pkgutil import iter_modules

from weld_twin_nodes.cli.options import add_command

from . import lab_jobs


def proofs() -> dict[str, str]:
    """Return the module of every proof by the name the command line has for it."""
    names = sorted(module.name for module in iter_modules(lab_jobs.__path__))
    return {name.replace('_', '-'): f'{lab_jobs.__name__}.{name}' for name in names}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the proofs, each with its options."""
    places = parser.add_subparsers(required=True, metavar='PROOF', dest='proof', title='proofs')
    for name, path in proofs().items():
        add_command(places, name, import_module(path))


def run(args: argparse.Namespace) -> int:
    """Run the proof."""
    return int(import_module(proofs()[args.proof]).run(args))

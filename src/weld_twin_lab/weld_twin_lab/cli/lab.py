# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Runs a proof."""

from __future__ import annotations

import argparse
from importlib import import_module
from pkgutil import iter_modules

from weld_twin_nodes.cli.parsing import Command, add_command

from . import lab_jobs


def proofs() -> dict[str, str]:
    """Return the module of every proof by the name the command line has for it."""
    names = sorted(module.name for module in iter_modules(lab_jobs.__path__))
    return {name.replace('_', '-'): f'{lab_jobs.__name__}.{name}' for name in names}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the proofs, each with its options."""
    places = parser.add_subparsers(required=True, metavar='PROOF', dest='proof', title='proofs')
    for name, path in proofs().items():
        proof = import_module(path)
        options = getattr(proof, 'OPTIONS', None) or (proof.add_arguments,)
        add_command(places, name, Command(str(proof.__doc__), options=options))


def run(args: argparse.Namespace) -> int:
    """Run the proof."""
    return int(import_module(proofs()[args.proof]).run(args))

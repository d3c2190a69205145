# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The proofs as subcommands of `weld-twin`, which finds them by their entry points."""

from __future__ import annotations

import argparse
from importlib import import_module

from weld_twin_nodes.cli.parsing import Command


def _proofs(parser: argparse.ArgumentParser) -> None:
    """Add the proofs; their options are loaded when the command is in use."""
    import_module(f'{__name__}.lab').add_arguments(parser)


ROWS = {
    'lab': Command('Run a proof: what weld_twin claims, one command each.', options=(_proofs,))
}

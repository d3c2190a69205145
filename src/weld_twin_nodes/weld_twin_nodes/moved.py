# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Modules that lie elsewhere now: their old names go on for one release, and say the new ones."""

import sys
import warnings
from collections.abc import Sequence
from importlib import import_module
from importlib.machinery import ModuleSpec
from types import ModuleType

_WORDING = ('mending', 'quantities', 'verdict', 'words')
_ROOMS = ('demo', 'fleet', 'guarded', 'history', 'report', 'sensitivity_report', 'serve')
_INTO = {
    'report': 'family_table answer cause_cards cause_list curve_plot charts root_frame controllers '
    'pdf diagnosis_files',
    'history': 'migrations schema opening schema tracking words',
    'fleet': 'listed running',
    'demo': 'closed_loop_page closed_loop demo_diagnosis analysis live_run analysis hand_over analysis',
    'serve': 'connections access bodies uploads',
    'sensitivity_report': 'whole work figures.posture figures.paths figures.together figures.sizes',
}
"""Modules of a room that stand in another one of it now: the old name, then the new one, and so on."""
_PAIRS = {room: iter(names.split()) for room, names in _INTO.items()}
MOVED = {
    'weld_twin_nodes.report.leading': 'weld_twin_nodes.wording.verdict',
    'weld_twin_nodes.report.switches': 'weld_twin_nodes.wording.mending',
    **{
        f'weld_twin_nodes.{room}.{old}': f'weld_twin_report.{room}.{new}'
        for room, names in _PAIRS.items()
        for old, new in zip(names, names, strict=True)
    },
    **{f'weld_twin_nodes.report.{name}': f'weld_twin_nodes.wording.{name}' for name in _WORDING},
    **{f'weld_twin_nodes.{name}': f'weld_twin_report.{name}' for name in _ROOMS},
}
"""Where a module lies now; what lies in a package that moved has moved with it."""


def new_name(name: str) -> str | None:
    """Return where a module lies now, None where it has not moved."""
    package = name
    while package:
        if package in MOVED:
            return MOVED[package] + name[len(package) :]
        package = package.rpartition('.')[0]
    return None


class Moved:
    """A finder and loader of modules by their old names: it gives the modules themselves, no copies."""

    @staticmethod
    def find_spec(
        name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return how a module that moved is loaded; None of any other."""
        return None if new_name(name) is None else ModuleSpec(name, Moved)  # type: ignore[arg-type]

    @staticmethod
    def create_module(spec: ModuleSpec) -> None:
        """Leave it to the import system to make a module; the real one takes its place."""

    @staticmethod
    def exec_module(module: ModuleType) -> None:
        """Put the module under its new name in the place of the old one."""
        old, new = module.__name__, str(new_name(module.__name__))
        warnings.warn(
            f"'{old}' is '{new}' now; the old name goes with the next release",
            DeprecationWarning,
            stacklevel=2,
        )
        sys.modules[old] = import_module(new)

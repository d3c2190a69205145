# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Whether the simulator that makes cases is there; only making them needs it."""

from __future__ import annotations

from importlib.util import find_spec

from weld_twin_core.errors import DataError


def require_simulator() -> None:
    """
    Refuse to go on without the simulator.

    Raises DataError: it is not installed.
    """
    if find_spec('mujoco') is None:
        raise DataError(
            "cases are simulated with MuJoCo; install it with: pip install 'weld-twin[bench]'"
        )

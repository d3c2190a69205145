# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""SALib, loaded when it is needed: it brings pandas along, and no ROS distribution packages it."""

from importlib import import_module
from typing import Any

from ..errors import DataError


def salib(module: str) -> Any:
    """
    Return a module of SALib, such as 'analyze.sobol'.

    Raises
    ------
    DataError
        It is not installed.

    """
    try:
        return import_module(f'SALib.{module}')
    except ImportError:
        raise DataError('Morris measures need SALib; install it with: pip install SALib') from None

# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Message types by their names, where the packages they come from are installed."""

from __future__ import annotations

from importlib import import_module
from typing import Any


def message_class(kind: str) -> Any:
    """
    Return the rclpy class of a message type.

    Raises
    ------
    ImportError
        The package is not installed here, or has no such message.

    """
    package, space, name = kind.split('/')
    try:
        return getattr(import_module(f'{package}.{space}'), name)
    except (ImportError, AttributeError):
        raise ImportError(
            f'the message type {kind} is not installed here; install the package {package}'
        ) from None

# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Channels of the chain, and displacements of them.

A *channel* is one scalar of the chain that an effect may displace: ``('q', i)``,
``('theta' | 'd' | 'a' | 'alpha' | 'beta', i)``, ``('base' | 'tool' | 'pose', 0..5)`` or
``('tau', i)``. A *shift* maps channels to displacements that broadcast with the samples.

"""

from __future__ import annotations

from collections.abc import Mapping

from ..arrays import Array

Channel = tuple[str, int]
Shift = Mapping[Channel, Array]
ROW_CHANNELS = ('theta', 'd', 'a', 'alpha', 'beta')
"""Channels of one Denavit-Hartenberg row."""
NO_SHIFT: Shift = {}

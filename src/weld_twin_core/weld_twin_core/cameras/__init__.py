# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Cameras as a measurement: what they saw, in pixels; `weld_twin_core.bundle` makes poses of it."""

from .sightings import Camera, Lens, Sightings, Target, described

__all__ = ['Camera', 'Lens', 'Sightings', 'Target', 'described']

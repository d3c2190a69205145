# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A simulated run as a bag."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from weld_twin_core import __version__
from weld_twin_core.errors import DataError
from weld_twin_msgs_py.bags import BagWriter
from weld_twin_msgs_py.messages import from_messages
from weld_twin_msgs_py.messages.to_messages import bag_messages
from weld_twin_msgs_py.messages.topics import DEVIATION_METRICS

from .simulation import Simulation


def write_simulation(
    path: Path | str,
    simulation: Simulation,
    *,
    storage: str = 'mcap',
    provenance: Mapping[str, Any] | None = None,
) -> Mapping[str, float]:
    """
    Write a bag with what the live nodes would publish; return the last metrics.

    Raises
    ------
    DataError
        The path exists or cannot be written, or no measurement meets the twin.

    """
    made = {
        'version': __version__,
        'robot': simulation.real.robot.to_mapping(),
        'effects': [effect.to_mapping() for effect in simulation.real.effects],
        'twin_effects': [effect.to_mapping() for effect in simulation.twin.effects],
        'seed': simulation.seed,
        **(provenance or {}),
    }
    metrics: Mapping[str, float] = {}
    with BagWriter(path, storage=storage, provenance=made) as bag:
        for stamp, topic, message in simulation.entries(bag_messages()):
            bag.write(topic, message, stamp)
            if topic == DEVIATION_METRICS.name:
                metrics = from_messages.metrics(message)
        if 'RMS' not in metrics:
            raise DataError(
                'no measurement meets a pose of the twin: the effects delay measurements beyond '
                'the end of the motion; take a shorter delay or a slower motion'
            )
    return metrics

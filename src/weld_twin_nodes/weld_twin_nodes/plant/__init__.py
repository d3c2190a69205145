# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
An independent robot cell to record from: product of exponentials and MuJoCo, no twin inside.

>>> from weld_twin_nodes.plant import Command, Tracker, run

"""

from weld_twin_nodes.plant.plant import KNOWN, run
from weld_twin_nodes.plant.recording import Command, PlantRecording
from weld_twin_nodes.plant.tracker import Tracker

__all__ = ['KNOWN', 'Command', 'PlantRecording', 'Tracker', 'run']

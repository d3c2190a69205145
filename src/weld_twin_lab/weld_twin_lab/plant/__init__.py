# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
An independent robot cell to record from: product of exponentials and MuJoCo, no twin inside.

`plant.run(robot, effects, command, tracker, rng, richness)` moves the robot of a robot file, with the
effects of an effects file built into it, along a command, and returns what tracker and
controller record. The parameters of the effects are the truth of the recording: the tests of the
plant measure them in its output.
"""

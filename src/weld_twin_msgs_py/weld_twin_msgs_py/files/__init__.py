# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Files of numbers and words: effects, paths, joint motions, diagnoses; written whole or not at all."""

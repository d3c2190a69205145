# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The parts of the answer, put together from what was found."""

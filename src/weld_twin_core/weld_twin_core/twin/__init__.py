# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A robot and effects in, poses and derivatives out: in bulk, live, and the other way round."""

# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Proof: an independent plant, sealed cases, campaigns, benchmarks, and real arms."""

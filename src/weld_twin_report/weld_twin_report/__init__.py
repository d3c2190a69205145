# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Diagnoses as people read them: pages, history, fleet, server, and the commands that write them."""

# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Is the gate right: every kind of mistake named, and no complaint about sound recordings?"""

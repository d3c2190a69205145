# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The arm as built: its DH rows, the kinematic chain over them, and the load on its joints."""

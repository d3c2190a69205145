# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How the results of campaigns are kept."""

# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Two real arms under a laser tracker: what the twin explains of them, on poses never fitted."""

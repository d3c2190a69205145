# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Whether what is named comes back when the search sees only half of the data."""

# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What holds on data that were not fitted: shrink, where the gap lies, what is left."""

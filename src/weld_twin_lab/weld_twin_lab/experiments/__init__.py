# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Do the experiments that are asked for decide? Sealed cells, run as asked, beside usual practice."""

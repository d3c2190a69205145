# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What every fit stands on: residuals, normal equations, scores, noise and standard errors."""

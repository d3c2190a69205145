# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The jobs of `weld-twin lab blind`, each with `add_arguments` and `run`."""

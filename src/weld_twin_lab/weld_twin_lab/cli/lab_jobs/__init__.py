# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The proofs of `weld-twin lab`, one module each: a docstring, `OPTIONS` and `run`."""

# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How far to trust an answer: signs in the evidence, and what cases with known truths taught."""

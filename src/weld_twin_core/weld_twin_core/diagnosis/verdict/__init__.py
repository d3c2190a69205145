# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""From evidence to an answer: what is named, how surely, and what is not."""

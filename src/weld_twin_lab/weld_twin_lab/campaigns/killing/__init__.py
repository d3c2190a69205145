# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""One kill of a recorder: feeding it, ending it, and comparing what is left with what was sent."""

# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Methods that take part, one file each: ``answer(case)`` gives what it says of a case."""

# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Before any cause: are data and set-up sound?

Each check is one function of a `Case` in one table (`gate.CHECKS`); it finds and names. What it finds
wrong with the set-up carries its own correction, and `gate` decides what comes of it. A node that
undoes what a diagnosis undid loads `mending` alone.
"""

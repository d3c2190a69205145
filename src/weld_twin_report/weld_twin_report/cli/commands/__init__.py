# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Commands that write pages; `weld_twin_nodes.cli.commands` says what a module here has."""

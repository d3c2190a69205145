# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The subcommands that write pages; `weld-twin` finds them by their files."""

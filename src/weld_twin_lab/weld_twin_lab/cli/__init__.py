# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The proofs as subcommands of `weld-twin`, which finds them by their entry points."""

# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Forms of logs and exports that are known, one file each; what is in this folder is asked."""

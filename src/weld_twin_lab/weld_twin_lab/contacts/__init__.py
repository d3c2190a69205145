# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Arms calibrated without an instrument: a ball in sockets, judged on places left out."""

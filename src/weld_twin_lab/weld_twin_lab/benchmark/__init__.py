# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
How fast the twin is, beside its peers.

A workload is one job given to several contenders. They must agree before any of them is timed;
then they take turns in one process, on one thread, so that what disturbs one disturbs all.
"""

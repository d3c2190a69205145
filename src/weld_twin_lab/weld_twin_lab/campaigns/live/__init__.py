# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What the campaigns with live nodes share: processes to time, feed and weigh."""

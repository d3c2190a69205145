# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Robot programs: are they read as they are meant, and does a corrected one help?"""

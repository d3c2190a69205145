# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Recordings of real arms that nobody tuned on: what is told of them, and do unseen data bear it out?"""

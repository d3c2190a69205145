# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Arms of the plant that touch things: a ball in sockets, with one flaw and some slack."""

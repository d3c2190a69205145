# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""`python -m weld_twin_nodes` is `weld-twin`."""

from .cli import main

raise SystemExit(main())

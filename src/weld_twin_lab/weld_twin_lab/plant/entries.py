# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Names for what the plant reads from files and hands about."""

from collections.abc import Mapping
from typing import Any

Entry = Mapping[str, Any]
"""A robot file, one of its parts, or one effect of an effects file, as YAML gives it."""

# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The nodes, the same without nodes, and the command line."""

import sys

from .moved import Moved

# Before the finder of files, which would load a module that moved a second time by its old name.
sys.meta_path.insert(0, Moved)

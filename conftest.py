# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Fixtures for every area."""

import os

# One core is enough for arrays of this size, and the test machine has other work.
os.environ.setdefault('OMP_NUM_THREADS', '1')

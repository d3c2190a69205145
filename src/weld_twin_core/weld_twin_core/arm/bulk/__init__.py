# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The chain for many joint positions at once: the same results as `chain`, prepared once."""

from .bulk_kernel import BulkKernel, kernel_of

__all__ = ['BulkKernel', 'kernel_of']

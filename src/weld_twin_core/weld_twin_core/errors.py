# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Errors a caller can act on; each message says what is wrong, where, and how to mend it."""


class TwinError(Exception):
    """Base of every error raised on purpose."""


class ModelError(TwinError):
    """A robot or effect description that cannot be used."""


class DataError(TwinError):
    """Samples that cannot be used: wrong shape, not finite, out of order, out of range."""


class PathError(TwinError):
    """A seam or time law that cannot be built or followed."""


class ReachError(PathError):
    """A pose the robot cannot reach."""

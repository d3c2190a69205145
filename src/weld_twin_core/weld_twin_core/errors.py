# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Errors a caller can act on; each message says what is wrong, where, and how to mend it.

Examples
--------
>>> import weld_twin_core as wt
>>> try:
...     wt.load('ur6')
... except wt.TwinError as error:
...     print(type(error).__name__, '-', str(error)[:33])
ModelError - no bundled robot is called 'ur6';

"""


class TwinError(Exception):
    """
    Base of every error raised on purpose.

    Examples
    --------
    >>> import weld_twin_core as wt
    >>> sorted(kind.__name__ for kind in wt.TwinError.__subclasses__())
    ['DataError', 'ModelError', 'PathError']

    """


class ModelError(TwinError):
    """
    A robot or effect description that cannot be used.

    Examples
    --------
    >>> import weld_twin_core as wt
    >>> try:
    ...     wt.Robot.from_mapping({'name': 'empty'})
    ... except wt.ModelError as error:
    ...     print(error)
    robot 'empty' needs a list 'joints' in chain order

    """


class DataError(TwinError):
    """
    Samples that cannot be used: wrong shape, not finite, out of order, out of range.

    Examples
    --------
    >>> import weld_twin_core as wt
    >>> try:
    ...     wt.Signal([0.0, 0.0], [20.0, 21.0])
    ... except wt.DataError as error:
    ...     print(str(error)[:64])
    signal stamps must increase, but sample 1 is at the same time as

    """


class PathError(TwinError):
    """
    A seam or time law that cannot be built or followed.

    Examples
    --------
    >>> import weld_twin_core as wt
    >>> try:
    ...     wt.profiles.named('gentle')
    ... except wt.PathError as error:
    ...     print(str(error)[:30])
    no profile is called 'gentle';

    """


class ReachError(PathError):
    """
    A pose the robot cannot reach.

    Examples
    --------
    >>> import weld_twin_core as wt
    >>> far = wt.paths.Line([5.0, 0.0, 0.0], [5.0, 1.0, 0.0])
    >>> try:
    ...     wt.plan(wt.load('ur5'), far)
    ... except wt.ReachError as error:
    ...     print(str(error)[:16])
    ur5 cannot reach

    """

# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Variables of the environment: set for a block, and those that keep linear algebra on one core."""

import os
from collections.abc import Iterator
from contextlib import contextmanager

THREADS = ('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS', 'MKL_NUM_THREADS')
"""What tells the libraries under numpy how many threads to use. Matrices here have a few hundred
rows: two threads spend more time waiting for each other than one takes for all the work."""


@contextmanager
def environment(**values: str) -> Iterator[None]:
    """Set variables for this process and those that it starts; afterwards they are as before."""
    before = {name: os.environ.get(name) for name in values}
    os.environ.update(values)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value

# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Commands that run in this process, and end as they should."""

from weld_twin_nodes.cli.in_process import weld_twin

__all__ = ['done', 'refused', 'weld_twin']


def done(*words: object) -> str:
    """Return what a command prints that ends well."""
    said = weld_twin(*words)
    assert said.code == 0, said.err
    return said.out


def refused(*words: object) -> str:
    """Return the one sentence with which a command ends that cannot do what it is asked."""
    said = weld_twin(*words)
    assert (said.code, said.err.count('\n')) == (2, 1), said
    return said.err

# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Run the nodes under enforced security, beside strangers without keys or with others.

Needs sros2 and a middleware that is built with DDS security; ``--source`` builds both from checkouts
of rmw_cyclonedds and sros2. Exits with 1 where it could not be shown; the file
tells why.
"""

from __future__ import annotations

import argparse

from ...campaigns import security
from ...study import options

CAMPAIGN = 'security'

OPTIONS = options(*security.OPTIONS, out='JSON file to write', of='FILE')


def run(args: argparse.Namespace) -> int:
    """Run the campaign of this name."""
    from .campaign import run as run_campaign

    return run_campaign(argparse.Namespace(**vars(args), campaign=CAMPAIGN))

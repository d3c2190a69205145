# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What the first two lines of our files say, for ``ament_copyright``.

It knows the long header of the Apache License alone, and asks packages for further ones by the entry
point ``ament_copyright.license``. This is the short form that the licence's own FAQ gives.
"""

from typing import NamedTuple


class ShortLicence(NamedTuple):
    """A licence as ``ament_copyright`` wants it stated."""

    name: str
    spdx: str
    file_headers: tuple[str, ...]
    license_files: tuple[str, ...]
    contributing_files: tuple[str, ...]


APACHE_2 = ShortLicence(
    'Apache License, Version 2.0, by its SPDX identifier',
    'Apache-2.0',
    ('{copyright}\nSPDX-License-Identifier: Apache-2.0\n',),
    (),
    (),
)

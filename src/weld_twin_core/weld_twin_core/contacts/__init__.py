# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Contacts as a measurement: a ball in a socket, a pin, a bar, a plane, each somewhere unknown."""

from .artefact import KINDS, Artefact, Contact, Contacts, Tie
from .places import Length, Places, Unknowns, lengths, places, spreads, unknowns

__all__ = ['KINDS', 'Artefact', 'Contact', 'Contacts', 'Length', 'Places', 'Tie', 'Unknowns']
__all__ += ['lengths', 'places', 'spreads', 'unknowns']

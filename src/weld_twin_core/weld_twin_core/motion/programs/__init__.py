# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Robot programs as numbers: points, moves between them, and the joint motion they make."""

from .travel import Move, MoveProgram, Piece, Travel, Use, travel

__all__ = ['Move', 'MoveProgram', 'Piece', 'Travel', 'Use', 'travel']

# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Programs drawn at random: moves where a robot works, written with lines that say nothing."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from weld_twin_core.arm.chain import forward
from weld_twin_core.arm.rotation import rotation_matrix, transform
from weld_twin_core.motion.paths import default_seam
from weld_twin_core.motion.planned_motion import plan
from weld_twin_msgs_py.programs.writing import Exported, ExportMove, written

from .cells import context_of, robot_of

MOVES = (2, 25)
"""Fewest and most moves of a program."""
AWAY = 0.12
"""How far the joints go from a comfortable posture [rad]: no singularity, no limit."""
FILLERS = {
    'urscript': ('  # checked', '  textmsg("movel(p[1,2,3,0,0,0])")', '  set_payload(2.5)', ''),
    'krl': ('; LIN {X 1}', '$OUT[9]=TRUE', ';FOLD weld;%{PE}', ';ENDFOLD', ''),
    'rapid': ('    ! MoveL p1,v5,fine,t;', '    TPWrite "MoveJ";', '    SetDO d1, 1;', ''),
    'inform': ("'MOVL C00000", 'DOUT OT#(9) ON', 'CALL JOB:CLEAN'),
    'fanuc-ls': ('   9:  !L P[1] ;', '   9:  DO[9]=ON ;', '   9:  CALL CLEAN ;'),
    'joint-trajectory': ('# positions: [1]', ''),
    'csv': ('# 1,2,3', ''),
}
"""Lines of every language that move nothing, some of which look as if they did."""


class Drawn(NamedTuple):
    """A program that was drawn, its text, and the text that stands around the moves."""

    program: Exported
    text: str


def drawn(language: str, rng: np.random.Generator) -> Drawn:
    """Return a program of a language."""
    robot = robot_of(language)
    seam = default_seam(robot, 'line')
    middle = plan(robot, seam, rate_hz=5.0).motion.q[0]
    length = rng.uniform(0.05, 0.4) if language not in ('joint-trajectory', 'csv') else 0.0
    tool = transform(rotation_matrix(rng.normal(0.0, 0.2, 3)), np.array([0.0, 0.0, length]))
    tool = tool if length else np.eye(4)
    context = context_of(language, tool)
    arm = robot.with_frames(base=np.eye(4), tool=context.controller.flange @ tool)
    moves = []
    for k in range(int(rng.integers(MOVES[0], MOVES[1]))):
        q = middle + rng.uniform(-AWAY, AWAY, robot.n)
        linear = bool(k and rng.random() < 0.7 and language != 'joint-trajectory')
        pose = np.linalg.inv(context.controller.origin) @ forward(arm, q)
        stop = bool(rng.random() < 0.5) or language == 'joint-trajectory'
        dwell = float(rng.choice([0.0, 0.5])) if stop else 0.0
        speed, share = float(rng.uniform(0.005, 0.25)), float(rng.uniform(0.02, 0.5))
        kind = 'linear' if linear else 'joint'
        moves.append(ExportMove(kind, q, pose, speed, share, stop, dwell))  # type: ignore[arg-type]
    stations = bool(rng.random() < 0.5)
    name = f'drawn{int(rng.integers(10**6))}'
    made = Exported(name, tuple(moves), context, tool, 5, stations, ('a drawn program',))
    return Drawn(made, _filled(written(made, language), language, rng))


def _filled(text: str, language: str, rng: np.random.Generator) -> str:
    """Return a text with lines between its moves that move nothing."""
    end = '\r\n' if '\r\n' in text else '\n'
    lines = text.split(end)
    begin = _first_move(lines, language)
    out = lines[:begin]
    last = next((k for k, line in enumerate(lines) if line.startswith('/POS')), len(lines) - 2)
    for k, line in enumerate(lines[begin:], start=begin):
        if k < last and rng.random() < 0.2:
            out.append(str(rng.choice(FILLERS[language])))
        out.append(line)
    return end.join(out)


def _first_move(lines: list[str], language: str) -> int:
    signs = {'inform': 'NOP', 'fanuc-ls': '/MN', 'joint-trajectory': 'points:', 'csv': 'move'}
    signs |= {'urscript': '  set_tcp', 'krl': '$APO', 'rapid': '    ConfL'}
    return 1 + next(k for k, line in enumerate(lines) if line.startswith(signs[language]))

# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Does a corrected program help? Out, in by another reader, run by another arm.

The plant records an arm with sealed causes, in free motion and along the seam as its program has it;
both are diagnosed; the program is corrected with what was found, and with the true causes beside
it. A reader that shares nothing with the product takes each program in, a plain controller that
knows no error interpolates it, and the plant runs it. The path is judged against the seam as the
program meant it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from weld_twin_core.arm.robot import Robot
from weld_twin_core.diagnosis import Diagnosis, diagnose
from weld_twin_core.effects import effects_from_list
from weld_twin_core.effects.setup_motion import of_the_robot
from weld_twin_core.errors import DataError
from weld_twin_core.twin.program_model import ProgramModel
from weld_twin_msgs_py.programs import Context, read_sources
from weld_twin_msgs_py.programs.source import Source
from weld_twin_nodes.offline.correcting import corrected_program
from weld_twin_nodes.offline.exporting import Speeds, export

from ..blind.blind_cell import as_recording
from ..blind.recorded_motion import motion
from ..plant.plant import run
from ..plant.plant_recording import Command
from ..plant.tracker import Tracker
from .cells import CELLS, context_of, robot_of
from .plain_arm import along, joints_for, tool_pose

TORCH = 0.25
"""Length of the torch [m]."""
NOISE = 3e-5
"""Of the tracker [m]."""
RECORDED = 30.0
"""Length of the free motion that is recorded [s]."""
STEP, SPEED, RATE = 0.005, 0.02, 50.0
"""Way between two places of the plain controller [m], its speed [m/s], samples a second."""
REST = 0.5
"""Stay at either end [s]."""


def correction(language: str, seed: int = 0) -> dict[str, Any]:
    """
    Return the path error of one seam before and after its program was corrected [m].

    Parameters
    ----------
    language : str
    seed : int

    """
    rng = np.random.default_rng([seed, sorted(CELLS).index(language)])
    context = context_of(language, along(2, TORCH))
    plain = robot_of(language)
    robot = plain.with_frames(tool=context.controller.flange @ along(2, TORCH))
    causes = _causes(robot, rng)
    context = context._replace(
        robot=robot, controller=replace(context.controller, own_tool=np.array(robot.T_flange_tool))
    )
    made, text, _ = export('arc', context, language, 'seam', Speeds(), 1)
    start = made.moves[0].q
    along_seam = _driven(robot, language, text, start)[0]
    found = _diagnosed(robot, causes, along_seam, rng)
    true = ProgramModel(robot, tuple(effects_from_list(causes, robot)))
    left = ''
    try:
        after = _corrected(language, text, context, _model(found))
    except DataError as error:  # left as it was, for the model knows too little of the place
        after, left = text, str(error)
    texts = {
        'before': text,
        'after': after,
        'true_causes': _corrected(language, text, context, true),
    }
    wanted = _driven(robot, language, text, start)[1]
    errors = {
        name: _errors(robot, causes, _driven(robot, language, one, start)[0], wanted)
        for name, one in texts.items()
    }
    return {
        'language': language,
        'robot': robot.name,
        'causes': causes,
        'status': found.status,
        'left': left,
        'path_error_m': {name: float(e.max()) for name, e in errors.items()},
        'rms_m': {name: float(np.sqrt((e**2).mean())) for name, e in errors.items()},
    }


def _causes(robot: Robot, rng: np.random.Generator) -> list[dict[str, Any]]:
    """Return causes of the size that arms have: a joint zero, a length, and play."""
    first, second, third = rng.permutation(robot.joint_names[:4])[:3]
    return [
        {'effect': 'joint_offset', 'joint': str(first), 'offset': float(rng.uniform(4e-4, 1e-3))},
        {'effect': 'link_twist', 'joint': str(second), 'dalpha': float(rng.uniform(3e-4, 6e-4))},
        {'effect': 'backlash', 'joint': str(third), 'width': float(rng.uniform(1e-4, 3e-4))},
    ]


def _diagnosed(
    robot: Robot, causes: Sequence[Any], along_seam: np.ndarray, rng: np.random.Generator
) -> Diagnosis:
    """Return the diagnosis of a free motion and of the seam, both with the tracker's noise."""
    moved = motion('free', robot, RECORDED, rng)
    tracker = Tracker(rate=60.0, sigma=NOISE)
    commands = {'free': Command(moved.t, moved.q), 'seam': _command(along_seam)}
    made = [
        as_recording(name, run(robot.to_mapping(), causes, command, tracker, rng))
        for name, command in commands.items()
    ]
    return diagnose(made, robot)


def _model(found: Diagnosis) -> ProgramModel:
    twin = found.model.twin(0)
    return ProgramModel(twin.robot, tuple(of_the_robot(twin.effects)), found.posterior)


def _corrected(language: str, text: str, context: Context, model: ProgramModel) -> str:
    name = f'seam{CELLS[language].suffix}'
    program = read_sources([Source(name, text)], context, language)
    return corrected_program(program, context, model).texts[0]


def _driven(
    robot: Robot, language: str, text: str, start: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return what a plain controller commands, (N, n), and where it believes the tool, (N, 3)."""
    tool, q = np.array(robot.T_flange_tool), np.array(start)
    out = []
    for k, (_, places) in enumerate(CELLS[language].reader([text])):
        place = places[-1]
        end = tool_pose(robot, place, tool) if place.ndim == 1 else place
        if k == 0:
            q = place if place.ndim == 1 else joints_for(robot, end, tool, q)
            out.append(q)
            continue
        begin = tool_pose(robot, q, tool)
        way = end[:3, 3] - begin[:3, 3]
        turn = Rotation.from_matrix(end[:3, :3] @ begin[:3, :3].T).as_rotvec()
        count = max(int(np.ceil(np.linalg.norm(way) / STEP)), 1)
        for share in np.arange(1, count + 1) / count:
            pose = np.eye(4)
            pose[:3, 3] = begin[:3, 3] + share * way
            pose[:3, :3] = Rotation.from_rotvec(share * turn).as_matrix() @ begin[:3, :3]
            q = joints_for(robot, pose, tool, q)
            out.append(q)
    joints = np.array(out)
    return joints, np.array([tool_pose(robot, row, tool)[:3, 3] for row in joints])


def _command(joints: np.ndarray) -> Command:
    """Return what a controller that goes along these joints commands, with a stay at either end."""
    clock = STEP / SPEED * np.arange(len(joints))
    stay = int(REST * RATE)
    t = np.arange(int(clock[-1] * RATE) + 1) / RATE
    moving = np.stack([np.interp(t, clock, column) for column in joints.T], axis=1)
    q = np.concatenate([np.tile(moving[0], (stay, 1)), moving, np.tile(moving[-1], (stay, 1))])
    return Command(np.arange(len(q)) / RATE, q)


def _errors(
    robot: Robot, causes: Sequence[Any], joints: np.ndarray, wanted: np.ndarray
) -> np.ndarray:
    """Return how far the plant's tool is from the line of the seam at every sample [m]."""
    command = _command(joints)
    made = run(robot.to_mapping(), causes, command, Tracker(), np.random.default_rng(0))
    stay = int(REST * RATE)
    real = made.position[stay : len(command.t) - stay]
    starts, ways = wanted[:-1], np.diff(wanted, axis=0)
    size = np.maximum((ways**2).sum(axis=1), 1e-18)
    share = np.clip(((real[:, None] - starts) * ways).sum(axis=2) / size, 0.0, 1.0)
    gap = real[:, None] - (starts + share[..., None] * ways)
    return np.asarray(np.linalg.norm(gap, axis=2).min(axis=1))

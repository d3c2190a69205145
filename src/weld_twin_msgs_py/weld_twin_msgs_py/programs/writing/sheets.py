# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The sheet that goes with a program: how to load it, run it first, and record."""

from __future__ import annotations

from collections.abc import Sequence

from .exported import Exported

LOADING: dict[str, tuple[str, str, str]] = {
    'urscript': (
        'Copy the file to the controller (USB stick, or SFTP to /programs). Put a Script node with '
        'this file into a program, or send it to port 30002.',
        'Record actual_q over RTDE (port 30004), such as with the RTDE client of Universal Robots, '
        'at 125 Hz or 500 Hz.',
        'digital output {trigger} (standard)',
    ),
    'krl': (
        'Copy the file to KRC:\\R1\\Program (USB stick, or WorkVisual), in the user group Expert.',
        'Record $AXIS_ACT_MEAS with the oscilloscope (trace) of the controller, or over RSI.',
        '$OUT[{trigger}]',
    ),
    'rapid': (
        'Load the module into task T_ROB1 (FlexPendant: Program Editor, or RobotStudio). Define the '
        'signal doTracker{trigger} first, and enter mass and centre of the tool into tMeasured.',
        'Record the joints with Test Signal Viewer, or poll Robot Web Services.',
        'signal doTracker{trigger}',
    ),
    'inform': (
        'Load the job from a USB stick (EX. MEMORY, LOAD, JOB). Tool 0 must hold the numbers below. '
        'Compare one point in the job with the pulses that the pendant shows.',
        'Record pulses over the Ethernet server (HSES), or with MotoROS2.',
        'OT#({trigger})',
    ),
    'fanuc-ls': (
        'Load the file from a USB stick or by FTP. A .ls needs the option ASCII Upload; without it, '
        'translate it to .tp with MakeTP of RoboGuide. UTOOL 1 must hold the numbers below.',
        'Record the joints with the data monitor, or over the stream motion or PC interface.',
        'DO[{trigger}]',
    ),
    'joint-trajectory': (
        'ros2 topic pub --once /TOPIC trajectory_msgs/msg/JointTrajectory "$(cat FILE)", or read the '
        'file in a node of yours. Send the arm to the first point before.',
        'ros2 bag record /joint_states, and the poses of the instrument.',
        'no output: a trajectory has none; measure by time',
    ),
    'csv': (
        'A table: one line is one move. Bring it into your own software.',
        'Record joint positions with their stamps.',
        'no output: a table has none',
    ),
}
"""For every language: how to load a program, how to record joints, what triggers the instrument."""


def sheet(program: Exported, language: str, file: str, speeds: str, notes: Sequence[str]) -> str:
    """
    Return the sheet as Markdown.

    file: name of the program's file.
    speeds: how fast it runs, in one sentence.
    notes: what to look out for, in sentences.
    """
    load, record, output = (text.format(trigger=program.trigger) for text in LOADING[language])
    when = 'while the arm stands' if program.stations else 'from the first to the last move'
    minutes = sum(m.duration + m.dwell for m in program.moves) / 60.0
    x, y, z = program.tool[:3, 3] * 1e3
    rows = [
        f'# {file}',
        '',
        f'{len(program.moves)} moves, about {minutes:.1f} minutes. {speeds}',
        '',
    ]
    rows += [f'- {text}' for text in program.comments]
    rows += ['', '## Load it', '', load, '']
    rows += [
        f'The tool must be {x:.3f} {y:.3f} {z:.3f} mm from the flange, as in the robot file.',
        '',
    ]
    rows += ['## Run it first', '']
    rows += [
        '1. Check every point for collisions: the file knows the arm, not your cell.',
        '2. Run it in manual mode at reduced speed, with a hand on the enabling switch.',
        '3. Only then run it in automatic mode and record.',
        '',
    ]
    rows += [f'- {note}' for note in notes] + ([''] if notes else [])
    rows += ['## Record', '', record, '']
    rows += [f'The instrument measures at: {output}, on {when}.', '']
    rows += [
        'Bring joints and measured positions into one table, a column for every joint and x, y, z,',
        'and read it with `weld-twin import TABLE.csv --robot ROBOT --out BAG`.',
        '',
    ]
    return '\n'.join(rows)

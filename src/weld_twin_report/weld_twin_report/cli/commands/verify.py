# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Was the promise of a correction kept? Measured again.

Says also which cause did not go away. With --program, the folder that correct wrote, the tool is held
against where the program meant it. Without, the robot itself was mended (zeros mastered, constants
entered, a gear serviced), and is held against its nominal model. Ends with 0 where the promise was
kept, with 4 where it was not.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from weld_twin_core.errors import DataError, ModelError
from weld_twin_nodes.cli.options import (
    ANY_ROBOT,
    FORCE,
    TOPICS,
    inputs_of,
    links_of,
    output,
    topics_of,
)

if TYPE_CHECKING:
    from weld_twin_core.arm.robot import Robot
    from weld_twin_nodes.offline.verifying import Verification

EXAMPLE = 'weld-twin verify after_bag --model found/diagnosis.json --program better'
RESULT, PAGE, CORRECTION = 'verification.json', 'report.html', 'correction.json'
NOT_KEPT = 4
"""Exit code where less was reached than promised."""


OPTIONS = (
    """
AFTER_BAG                recorded after the correction
--model FILE, required   diagnosis.json that the correction is from
--program DIR            folder that correct wrote, where a program was corrected
""",
    ANY_ROBOT,
    """
--align FRAMES           frames that were set up anew since the diagnosis, and are fitted: base, tool,
                         or base,tool (default: both are as they were)
--out DIR                folder for verification.json and a page
rare:
--setup N                which recording of the diagnosis [default: 1]
""",
    FORCE,
    TOPICS,
)


def run(args: argparse.Namespace) -> int:
    """Compare, say what was promised and what was measured, write it where asked."""
    from weld_twin_msgs_py.bags import read_recording
    from weld_twin_msgs_py.files.diagnosis_model import mended_source, read_diagnosis, read_model
    from weld_twin_nodes.offline.verifying import verified

    from ...report.verification_page import result_lines

    content = read_diagnosis(args.model)
    robot = _robot(args, content)
    model = read_model(robot, args.model)
    if not 0 < args.setup <= len(model.bases):
        raise DataError(f'the diagnosis has {len(model.bases)} set-up(s), not {args.setup}')
    recording = read_recording(
        args.after_bag, robot, topics_of(args), one_clock=False, needs_measurements=True
    )
    recording, mended = mended_source(model, robot, recording, args.setup - 1)
    result = verified(
        content,
        model,
        recording,
        correction=_correction(args.program) if args.program else None,
        align=args.align,
        setup=args.setup - 1,
    )
    if mended:
        print(f'note: {mended}')
    for line in result_lines(result):
        print(line)
    if args.out:
        _write(args, content, recording.epoch_ns, result)
    return 0 if result.kept else NOT_KEPT


def _write(
    args: argparse.Namespace, content: dict[str, Any], epoch_ns: int, result: Verification
) -> None:
    """Write verification.json and the page."""
    from weld_twin_msgs_py.files.whole_files import write_json, write_text

    from ...report.verification_page import verification_page

    inputs = inputs_of(recording=args.after_bag, model=args.model)
    entry = result.as_dict() | {
        'robot': content['model']['robot'],
        'kinematics': content['model']['kinematics'],
        'epoch_ns': epoch_ns,
        'inputs': [item.as_dict() for item in inputs],
    }
    with output(args, RESULT) as place:
        write_text(place / PAGE, verification_page(result, str(entry['robot']), inputs))
        write_json(place / RESULT, entry)
    print(f'report: {Path(args.out) / PAGE}')


def _robot(args: argparse.Namespace, content: dict[str, Any]) -> Robot:
    """Return the robot that was named, else the one that the diagnosis was made with."""
    from weld_twin_msgs_py.robots import load_robot

    links = links_of(args)[:2]
    if args.robot:
        return load_robot(args.robot, *links)
    files = [item['path'] for item in content.get('inputs', []) if item.get('use') == 'robot']
    name = files[0] if files else str((content.get('model') or {}).get('robot'))
    try:
        return load_robot(name, *links)
    except ModelError:
        raise ModelError(
            f'the robot of the diagnosis, {name!r}, is not to be found here; give it with --robot'
        ) from None


def _correction(folder: str) -> dict[str, Any]:
    from weld_twin_msgs_py.files.whole_files import read_json

    path = Path(folder)
    path = path / CORRECTION if path.is_dir() else path
    content = read_json(path)
    if not isinstance(content.get('expected'), dict):
        raise DataError(
            f"'{path}' is no correction; give the folder that weld-twin correct --model wrote"
        )
    return content

# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Was the promise of a correction kept?"""

from pathlib import Path
from typing import Any

from weld_twin_core.arm.known_arms import fingerprint
from weld_twin_core.arm.robot import Robot
from weld_twin_core.errors import DataError, ModelError
from weld_twin_msgs_py.files.diagnosis_model import mended_source, read_diagnosis, read_model
from weld_twin_msgs_py.files.whole_files import read_json
from weld_twin_msgs_py.robots import load_robot
from weld_twin_nodes.cli.given import Given, inputs_of, refuse_changed
from weld_twin_nodes.offline.verifying import verified

from ...report.verification_page import result_lines, verification_page

RESULT, CORRECTION = 'verification.json', 'correction.json'
NOT_KEPT = 4
"""Exit code where less was reached than promised."""


def run(given: Given) -> int:
    """Compare, say what was promised and what was measured, write it where asked."""
    inputs = inputs_of(recording=given.after_bag, model=given.model)
    content = read_diagnosis(given.model)
    robot = _robot(given, content)
    model = read_model(robot, given.model)
    if not 0 < given.setup <= len(model.bases):
        raise DataError(f'the diagnosis has {len(model.bases)} set-up(s), not {given.setup}')
    recording = given.read_bag(given.after_bag, robot, one_clock=False, needs_measurements=True)
    recording, mended = mended_source(model, robot, recording, given.setup - 1)
    result = verified(
        content,
        model,
        recording,
        correction=_correction(given.program, given.model) if given.program else None,
        align=given.align,
        setup=given.setup - 1,
    )
    if mended:
        print(f'note: {mended}')
    print(*result_lines(result), sep='\n')
    if given.out:
        refuse_changed(inputs)
        arm = content['model']  # of an older version it does not name its robot
        entry = result.as_dict() | {
            'robot': arm.get('robot', robot.name),
            'kinematics': arm.get('kinematics', fingerprint(robot)),
            'epoch_ns': recording.epoch_ns,
            'inputs': [item.as_dict() for item in inputs],
        }
        given.write_results(RESULT, verification_page(result, str(entry['robot']), inputs), entry)
        given.say_page()
    return 0 if result.kept else NOT_KEPT


def _robot(given: Given, content: dict[str, Any]) -> Robot:
    """Return the robot that was named, else the one that the diagnosis was made with."""
    links = given.links[:2]
    if given.robot:
        return load_robot(given.robot, *links)
    files = [item['path'] for item in content.get('inputs') or () if item.get('use') == 'robot']
    name = files[0] if files else str((content.get('model') or {}).get('robot'))
    try:
        return load_robot(name, *links)
    except ModelError:
        raise ModelError(
            f'the robot of the diagnosis, {name!r}, is not to be found here; give it with --robot'
        ) from None


def _correction(folder: str, model: str) -> dict[str, Any]:
    path = Path(folder)
    path = path / CORRECTION if path.is_dir() else path
    content = read_json(path)
    if not isinstance(content.get('expected'), dict):
        raise DataError(
            f"'{path}' is no correction; give the folder that weld-twin correct --model wrote"
        )
    (own,) = inputs_of(model=model)
    made = [item['sha256'] for item in content.get('inputs') or () if item['use'] == own.use]
    if made not in ([], [own.sha256]):
        raise DataError(
            f"the program of '{path}' was corrected by another diagnosis than '{model}'; give that "
            'one, for it made the promise'
        )
    return content

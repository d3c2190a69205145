# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What other software loads: a corrected model, a robot program, a policy, a schema."""

import json
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from weld_twin_core.errors import DataError

from ..given import Given, pair, quantity


def model(given: Given) -> int:
    """Write the model of a diagnosis, or print it."""
    from weld_twin_msgs_py.files.diagnosis_model import read_model
    from weld_twin_msgs_py.files.posterior_entry import read_posterior

    from ...offline.exports import FORMATS, where_it_holds, write_given_urdf

    robot = given.load_robot()
    model, posterior = read_model(robot, given.model), read_posterior(robot, given.model)
    notes = [] if posterior is None else where_it_holds(posterior)
    name, write = FORMATS[given.format]
    urdf = given.find_urdf()
    if urdf is not None and given.format == 'urdf':
        write = partial(write_given_urdf, given=urdf)
    if given.out:
        with given.output_file() as path:
            write(path, model, notes)
        return 0
    with TemporaryDirectory() as scratch:
        write(Path(scratch) / name, model, notes)
        return given.write_or_print((Path(scratch) / name).read_text(encoding='utf-8'))


def program(given: Given) -> int:
    """Write a seam or an experiment as a robot program, and the sheet beside it."""
    from ...offline.exporting import FAST, SLOW, Speeds, write_program

    given.check_program()
    if not 0.0 <= given.dwell <= 600.0:
        raise DataError('--dwell must be 0 to 600 s')
    context = given.program_context(given.load_robot(), given.controller)
    speed = (
        quantity(given.speed.removesuffix('/s'), ('mm', 'm'), '--speed') if given.speed else 0.0
    )
    how = Speeds(*(FAST if given.full_speed else SLOW), given.dwell)
    with given.output_file() as made:
        lines = write_program(
            *(made, Path(given.out), given.path, context, given.controller, how),
            trigger=given.trigger,
            seam_speed=speed,
            faster='; --full-speed writes it faster',
        )
    print('\n'.join(lines))
    return 0


def policy(given: Given) -> int:
    """Write the security policy of the nodes, or print it."""
    from ...live.policy import policy

    remaps = dict(pair(text, '--remap', 'FROM:=TO', ':=') for text in given.remap)
    nodes = ', '.join(given.nodes) or 'all nodes'
    text = policy(given.namespace, remaps, given.nodes)
    return given.write_or_print(text, f'{given.out}: policy for {nodes}')


def schema(given: Given) -> int:
    """Write the JSON Schema of a kind of file, or print it."""
    from weld_twin_msgs_py.files.schemas import NAMES, schema

    if given.kind not in NAMES:
        raise DataError(f'there is no schema {given.kind!r}; there are {", ".join(NAMES)}')
    return given.write_or_print(json.dumps(schema(given.kind), indent=1) + '\n')

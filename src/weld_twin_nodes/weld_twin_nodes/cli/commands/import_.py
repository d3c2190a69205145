# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Make a bag of a table of what was measured, seen or touched."""

from weld_twin_core.contacts import spreads
from weld_twin_core.errors import ModelError
from weld_twin_core.metrics.deviation import deviation_metrics
from weld_twin_core.twin.twin import Twin
from weld_twin_msgs_py.bags import write_recording

from ..given import Given


def run(given: Given) -> int:
    """Write the bag, say how the table was read and how far the nominal twin is off."""
    robot = given.load_robot()
    if given.contacts and (given.table or given.picture):
        raise ModelError('--table and --picture need measured positions; contacts have none')
    recording, said = given.read_table(robot, given.file)
    nominal, contacts, measured = Twin(robot), recording.contacts, recording.measured
    how = {
        'storage': given.storage,
        'provenance': {'source': given.file, 'assumptions': list(said)},
    }
    if contacts is not None:
        write_recording(given.out, recording, robot, **how)
        points = nominal.poses(recording, recording.joints.t).position
        for label, each in spreads(contacts, points).items():
            said = (*said, f'{label}: nominal twin {each.mean() * 1e3:.3f} mm off on average')
        end = f'{contacts.size} postures; weld-twin diagnose takes the bag'
        print(*said, f'{given.out}: {end}', sep='\n')
        return 0
    assert measured is not None
    expected = nominal.poses(recording, measured.t)
    off = measured.position - expected.position
    twin = nominal.poses(recording)
    write_recording(given.out, recording, robot, twin=twin, deviation=off, **how)
    print(*said, sep='\n', end='\n' if said else '')
    if given.table or given.picture:
        from ...offline.prediction import draw, write_table

        if given.table:
            write_table(given.table, recording, off)
        if given.picture:
            draw(given.picture, recording, off)
    kind = 'stations' if recording.joints.static else 'measurements along a motion'
    result = deviation_metrics(measured.position, expected.position)
    print(
        f'{given.out}: {result.samples} {kind}; from the nominal twin, base and tool frame not '
        f'fitted: RMS {result.rms_m * 1e3:.3f} mm, max {result.max_m * 1e3:.3f} mm'
    )
    return 0

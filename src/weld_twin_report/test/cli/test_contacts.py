# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""From a table of touches to a corrected URDF, as a user without a tracker goes."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

import weld_twin_core as wt
from weld_twin_core.arm.chain import forward
from weld_twin_core.motion.inverse.newton import reaching
from weld_twin_msgs_py.robots import load_robot, write_urdf
from weld_twin_nodes.cli.in_process import weld_twin

PLACES = {
    'low a': [0.45, 0.1, 0.2],
    'low b': [0.45, 0.15, 0.2],
    'high a': [-0.1, 0.5, 0.4],
    'high b': [-0.05, 0.5, 0.4],
}
EACH = 12


@pytest.fixture(scope='module')
def cell(tmp_path_factory):
    """Return a directory with a URDF, and touches of an arm whose elbow stands 2 mrad off."""
    folder, rng = tmp_path_factory.mktemp('cell'), np.random.default_rng(5)
    tool = np.eye(4)
    tool[:3, 3] = [0.02, 0.03, 0.12]
    robot = wt.load('ur5').with_frames(tool=tool)
    write_urdf(folder / 'cell.urdf', robot)
    real = replace(robot, theta=robot.theta + 0.002 * (np.arange(6) == 2))
    rows = [','.join((*robot.joint_names, 'contact'))]
    for label, place in PLACES.items():
        found, good = reaching(real, np.tile(place, (80, 1)), rng.uniform(-2.0, 2.0, (80, 6)))
        for q in found[good][:EACH]:
            rows.append(','.join((*(f'{v:.7f}' for v in q + rng.normal(0.0, 3e-5, 6)), label)))
    (folder / 'touches.csv').write_text('\n'.join(rows) + '\n')
    (folder / 'artefact.yaml').write_text(
        'contacts: {low a: point, low b: point, high a: point, high b: point}\n'
        'distances:\n  - {between: [low a, low b], value: 0.05, sigma: 0.0001}\n'
        '  - {between: [high a, high b], value: 0.05, sigma: 0.0001}\n'
    )
    return folder


def test_touches_become_a_corrected_urdf(cell):
    urdf = ('--robot', str(cell / 'cell.urdf'))
    artefact = ('--contacts', str(cell / 'artefact.yaml'))
    bag, out = str(cell / 'bag'), cell / 'out'
    told = weld_twin('import', str(cell / 'touches.csv'), *artefact, *urdf, '--out', bag).out
    rows = [row.split(',') for row in (cell / 'touches.csv').read_text().splitlines()[1:]]
    q = np.array([row[:6] for row in rows if row[6] == 'low a'], dtype=float)
    points = forward(load_robot(cell / 'cell.urdf'), q)[:, :3, 3]
    off = 1e3 * np.linalg.norm(points - points.mean(axis=0), axis=1).mean()
    assert f'low a: nominal twin {off:.3f} mm off on average' in told
    said = weld_twin('diagnose', bag, *urdf, '--out', str(out)).out
    assert 'mm from what it touched on average' in ' '.join(said.split())

    found = json.loads((out / 'diagnosis.json').read_text())
    named = [(item['effect'], item['joint']) for item in found['verdict']['effects']]
    assert named == [('joint_offset', 'elbow_joint')]
    contacts = found['contacts']
    assert contacts['spread_before_m'] > 5 * contacts['held_out_spread_m']
    assert contacts['held_out_spread_m'] < 1e-4
    assert [item['between'] for item in contacts['distances']] == [
        ['low a', 'low b'],
        ['high a', 'high b'],
    ]
    assert 'where the base stands' in contacts['not_seen']
    assert 'joint offset of shoulder_pan_joint' in '; '.join(contacts['not_seen'])
    corrected = load_robot(out / 'robot.urdf')
    assert corrected.theta[2] - load_robot(cell / 'cell.urdf').theta[2] == pytest.approx(
        0.002, abs=1e-4
    )
    assert 'id="contacts"' in (out / 'report.html').read_text()
    again = weld_twin('export', out / 'diagnosis.json', *urdf, '--format', 'urdf')
    names = re.compile(r'<(?:link|joint) name="([^"]+)"')
    assert set(names.findall(again.out)) == set(names.findall((cell / 'cell.urdf').read_text()))

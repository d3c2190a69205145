# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Arms drawn as URDFs: told to the plant and to the product alike, and counted as they came out."""

import numpy as np
import pytest

from weld_twin_lab.programs.urdf_table import counted, page, totals
from weld_twin_msgs_py.robots import load_robot

pin = pytest.importorskip('pinocchio', reason='the arms are worked out by another library')
pytest.importorskip('mujoco', reason='the plant needs MuJoCo')

from weld_twin_lab.programs.drawn_urdf import HANDS, drawn_arm  # noqa: E402
from weld_twin_lab.programs.plain_arm import tool_pose  # noqa: E402
from weld_twin_lab.programs.urdf_trial import UrdfCell  # noqa: E402


@pytest.mark.parametrize('number', range(7))
def test_urdf_plant_and_controller_are_one_arm(number, tmp_path):
    arm = drawn_arm(3, number)
    (tmp_path / 'arm.urdf').write_text(arm.urdf)
    model = pin.buildModelFromUrdf(str(tmp_path / 'arm.urdf'))
    data, q = model.createData(), np.random.default_rng(number).uniform(-2.0, 2.0, 6)
    pin.framesForwardKinematics(model, data, q)
    told = '--base-link' in arm.options
    base = 'base' if arm.maker in ('ur', 'fanuc') and not told else 'base_link'
    flange = HANDS[arm.maker][2]
    place = {name: data.oMf[model.getFrameId(name)] for name in (base, flange, 'tcp')}
    for link, tool in ((flange, np.eye(4)), ('tcp', np.array(arm.controller.T_flange_tool))):
        wanted = (place[base].inverse() * place[link]).homogeneous
        np.testing.assert_allclose(tool_pose(arm.controller, q, tool), wanted, atol=1e-9)
        cell = UrdfCell(arm, [], np.eye(4), np.eye(4), tmp_path)
        position, turned = cell.poses(q[None], [], tool)
        np.testing.assert_allclose(position[0], wanted[:3, 3], atol=1e-9)
        np.testing.assert_allclose(turned[0], wanted[:3, :3], atol=1e-9)
    links = ('base_link' if told else None), 'tcp'
    found = load_robot(tmp_path / 'arm.urdf', *links).controller
    assert (found.base_link, found.flange_link) == (base, flange)


def case(number, after, outcome='corrected', best=1e-5):
    return {
        'number': number,
        'kind': 'down',
        'maker': 'kuka',
        'linear_apart_m': 1e-9,
        'files_apart_m': 1e-12,
        'signs': True,
        'outcome': outcome,
        'why': '' if outcome == 'corrected' else 'seam.src cannot be corrected: too little',
        'worst_m': {'before': 4e-4, 'after': after, 'best': best, 'true': 0.0},
    }


def test_a_refusal_is_not_corrected_and_a_seam_that_cannot_gain_does_not_count():
    cases = [case(0, 2e-5), case(1, 5e-4), case(2, 4e-4, 'left'), case(3, 4e-4, 'left', 3e-4)]
    found = counted([*cases, {'number': 4, 'kind': 'up', 'maker': 'ur', 'failed': 'simulate: no'}])
    assert (found['arms'], found['failed'], found['worse']) == (5, 1, 1)
    assert (found['able'], found['corrected']) == (3, 1)
    assert found['ratio_of_corrected']['median'] == pytest.approx(2.0)
    told = page({'seed': 1, 'totals': totals(cases), 'cases': cases})
    assert told.count('| too little |') == 2

# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Friction, hysteresis and wear of the plant, its loads and its lines of sight, by hand."""

import numpy as np
import pytest
from plant_cells import UR5, dh_links, dh_positions, joint_displacement, record, stations, weave
from scipy.spatial.transform import Rotation

from weld_twin_lab.plant.flaws import Causes, Here, frame, known, on_joints

TILT = {'effect': 'pedestal_tilt', 'compliance': [1e-5, 3e-5]}
HOSE = {'effect': 'hose_pull', 'hook': [-0.3, 0.2, 1.4], 'tension': 30.0, 'length': 1.2}
SPRING = {'effect': 'joint_compliance', 'joint': 'j1', 'compliance': 1e-5}


def test_a_moving_arm_shakes_its_pedestal_a_little():
    command = weave(UR5, 4.0)
    still, shaken = (
        record(UR5, [TILT], command, richness=richness).position for richness in (0.0, 1.0)
    )
    size = np.abs(still - dh_positions(UR5, command.q)).max()
    assert 1e-3 * size < np.abs(shaken - still).max() < 0.3 * size


def test_a_hose_pulls_its_joint_by_the_work_it_does():
    command, step = stations(UR5, 12), 1e-6 * np.eye(6)[1]
    both, alone = (
        joint_displacement(UR5, effects, command, 'j1', richness=0.0)
        for effects in ([SPRING, HOSE], [SPRING])
    )

    def far(q):
        return np.linalg.norm(dh_links(UR5, q)[-1][:3, 3] - HOSE['hook'])

    def high(q):
        return dh_links(UR5, q)[-1][2, 3]

    for q, turned in zip(command.q, both - alone, strict=True):
        tension = 30.0 * (1.0 + 0.5 * (far(q) / 1.2 - 1.0))
        work = tension * (far(q + step) - far(q - step)) + 6.0 * (high(q + step) - high(q - step))
        torque = -work / 2e-6
        assert turned == pytest.approx(1e-5 * torque, abs=2e-7)


def test_a_line_of_sight_bends_as_the_maker_of_a_laser_says():
    """Hamar Laser, Stealth series, appendix D: 0.008 in over 40 ft, at 3 K/m of still air."""
    place = 12.192 * np.array([1.0, 0.0, 0.0])
    far = {**UR5, 'base': {'xyz': (place - dh_positions(bare(), np.zeros((1, 6)))[0]).tolist()}}
    bent = {'effect': 'refraction', 'warming': [0.0, 0.0, 3.0]}
    command = stations(far, 1)
    command = type(command)(command.t, np.zeros((1, 6)), static=True)
    off = record(far, [bent], command, richness=0.0).position[0] - place
    assert off[2] == pytest.approx(0.008 * 0.0254, rel=0.03)
    np.testing.assert_allclose(off[:2], 0.0, atol=1e-8)


def bare():
    """Return the arm with its base at the origin of the world."""
    return {key: value for key, value in UR5.items() if key != 'base'}


LEVER = np.array([0.0, 0.06, 0.3])
SAG = {'effect': 'tool_sag', 'bend': 1e-3 * np.linalg.norm(LEVER), 'lever': LEVER.tolist()}


def test_a_torch_sags_by_its_bend_where_it_is_level_and_by_nothing_where_it_hangs():
    command = stations(UR5, 12)
    moved = record(UR5, [SAG], command, richness=0.0).position - dh_positions(UR5, command.q)
    world = Rotation.from_quat(UR5['base']['quat_xyzw'])
    held = Rotation.from_quat(UR5['tool']['quat_xyzw'])
    for row, got in zip(command.q, moved, strict=True):
        bar = Rotation.from_matrix(dh_links(UR5, row)[-1][:3, :3]).apply(held.apply(LEVER))
        level = np.hypot(bar[0], bar[1])
        # It turns in the upright plane through the bar, by the share of it that is level.
        down = 1e-3 * level / np.linalg.norm(LEVER)
        aside = world.apply([*(bar[:2] * bar[2] / level), -level])
        assert got == pytest.approx(down * aside, abs=2e-3 * down * np.linalg.norm(LEVER) + 1e-9)


def test_a_flat_bracket_bends_less_about_its_second_axis():
    command = stations(UR5, 12)
    straight = dh_positions(UR5, command.q)
    even, flat = (
        np.linalg.norm(record(UR5, [SAG], command, richness=r).position - straight, axis=1)
        for r in (0.0, 1.0)
    )
    assert (flat < even + 1e-9).all()
    assert flat.min() < 0.8 * even.max()


JOINTS = ('j0', 'j1')


def here(t, q, richness, entry):
    """Return what a flaw of an arm of two joints sees."""
    assert entry['effect'] in known()
    return Here(Causes((entry,), JOINTS), None, t, q, richness, np.random.default_rng(0))


def moved(q, rate=1000.0, richness=1.0, **entry):
    """Return the displacement of joint j1 along positions sampled at a rate."""
    q = np.stack([np.zeros(len(q)), q], axis=1)
    out = on_joints(here(np.arange(len(q)) / rate, q, richness, {'joint': 'j1', **entry}))
    assert not out[:, 0].any()
    return out[:, 1]


def there_and_back(speed, pause=0.0):
    """Return positions at 1 kHz: a second up, a pause, a second down."""
    up = speed * np.linspace(0.0, 1.0, 1000)
    return np.concatenate([up, np.full(int(1000 * pause), speed), up[::-1]])


@pytest.mark.parametrize('richness', [0.0, 1.0])
def test_friction_trails_by_its_wind_up_both_ways_and_more_in_one(richness):
    entry = {'effect': 'friction', 'windup': 1e-3, 'asymmetry': 0.2}
    found = moved(there_and_back(0.3), richness=richness, **entry)
    assert found[900] == pytest.approx(-1.2e-3, rel=0.01)
    assert found[-50] == pytest.approx(0.8e-3, rel=0.01)


def test_friction_breaks_away_higher_and_lets_go_in_a_pause():
    slow = moved(there_and_back(0.008), effect='friction', windup=1e-3)
    assert slow[900] < -1.05e-3
    paused = moved(there_and_back(0.3, pause=0.5), effect='friction', windup=1e-3)
    assert abs(paused[1490]) < 0.02e-3


def test_hysteresis_closes_after_twice_its_travel_and_small_loops_close_on_themselves():
    entry = {'effect': 'hysteresis', 'amplitude': 1e-3, 'travel': 0.05}
    wide = moved(there_and_back(0.5), **entry)
    assert wide[[999, -1]] == pytest.approx([-1e-3, 1e-3], rel=1e-6)
    small = 0.3 + 0.01 * np.sin(np.arange(4000) * np.pi / 200.0)
    loops = moved(np.concatenate([np.linspace(0.0, 0.3, 500), small]), **entry)[500:]
    assert loops[3200:3600] == pytest.approx(loops[3600:4000], abs=1e-9)
    assert np.ptp(loops[3200:]) < 0.7e-3


def test_a_full_reversal_is_half_undone_after_seven_tenths_of_its_travel():
    """As in the textbook, where half is left after travel times the logarithm of two."""
    q = there_and_back(0.5)
    found = moved(q, effect='hysteresis', amplitude=1e-3, travel=0.05)
    half = np.flatnonzero(found[1000:] > 0.0)[0]
    assert (q[999] - q[1000 + half]) / 0.05 == pytest.approx(np.log(2.0), rel=0.25)


def test_a_tip_wears_at_its_rate_first_and_slower_later():
    tip = {'effect': 'wear', 'rate': 1e-5, 'slower': 50.0}
    back = frame('tool', here(np.array([0.0, 1.0, 1e4]), None, 1.0, tip)).position
    np.testing.assert_allclose(back[:, 2], [0.0, -1e-5, -5e-4], rtol=0.011)
    assert not back[:, :2].any()

# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What a machine can have: a spread and a range for every parameter of every effect.

The spread (``sd``) is that of a Gaussian about zero, the prior of every fit; what lies outside
the range is never named as a cause. ``source`` says where the figures come from: a publication
that was read, or, where none was found, an argument that starts with 'derived'; those are wide.
docs/plausible.md lists them. A robot may narrow them: key ``plausible`` of a robot file.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..arm.robot import Robot
from ..arrays import Array
from .effect import Effect
from .transmission_ripple import TransmissionRipple

URS = (
    'controller calibrations of a UR3 (github.com/MyRobotLab/pyrobotlab issue 145) and of a UR5 '
    '(github.com/UniversalRobots/Universal_Robots_ROS_Driver issue 457): rows between axes that '
    'are not parallel'
)
RV = (
    'backlash of 1 to 1.5 arcmin and angle errors of at most 1 arcmin allowed for reducers of '
    'robots (zhygear.com, analysis-and-control-of-backlash-in-rv-reducers)'
)


@dataclass(frozen=True)
class Plausible:
    """
    Spread and range of one parameter, in its own unit.

    Attributes
    ----------
    sd : float
        Standard deviation among machines, and of what people do to them.
    low, high : float
        What lies outside is no property of a machine.
    source : str

    """

    sd: float
    low: float
    high: float
    source: str

    @property
    def derived(self) -> bool:
        """Return whether no publication stands behind it."""
        return self.source.startswith('derived')


def _even(sd: float, most: float, source: str) -> Plausible:
    return Plausible(sd, -most, most, source)


TABLE: dict[tuple[str, str], Plausible] = {
    ('joint_offset', 'offset'): _even(
        5e-3,
        0.13,
        'a mastering 16 degrees of the motor off is 0.2 degrees (3.5 mrad) of the joint; arms '
        'mastered on wrong marks were 5 to 7 degrees off (industrialmonitordirect.com, KR16 '
        'mastering deviation and KR3 mastering error)',
    ),
    ('link_length', 'da'): _even(
        5e-4, 1e-2, f'{URS}: 0.02 to 0.28 mm; range derived: beyond a centimetre it is another arm'
    ),
    ('link_offset', 'dd'): _even(
        5e-4, 1e-2, f'{URS}: 0.09 to 0.32 mm; range derived: beyond a centimetre it is another arm'
    ),
    ('link_twist', 'dalpha'): _even(2e-3, 2e-2, f'{URS}: 0.4 to 3.9 mrad'),
    ('axis_parallelism', 'dbeta'): _even(
        2e-3, 2e-2, 'derived: a tilt of the same kind as link_twist, of the same size'
    ),
    ('gear_ratio', 'scale'): _even(
        1e-3,
        2e-2,
        'derived: tooth numbers are exact, what is left is belts and scales of encoders; one tooth '
        'in fifty is the coarsest wrong ratio',
    ),
    ('gear_ratio_by_direction', 'difference'): _even(
        1e-3,
        2e-2,
        'derived: as gear_ratio; at a radian from zero the flanks are then as far apart as the play '
        'of a gear that is broken',
    ),
    ('gear_ratio_by_direction', 'travel'): Plausible(
        1e-3,
        1e-6,
        2e-3,
        'derived: teeth change flanks as friction builds up; a longer travel is '
        'a loop of the gear, hysteresis',
    ),
    ('joint_coupling', 'ratio'): _even(
        1e-3,
        2e-2,
        'motion that leaks through a wrist is divided by its reduction of 50:1 to 120:1 '
        '(industrialmonitordirect.com, KR16 mastering deviation): at most 1/50',
    ),
    ('transmission_ripple', 'amplitude'): _even(
        2e-4, 3e-3, f'{RV}; range derived: ten times that, a gear that is worn out'
    ),
    ('backlash', 'width'): Plausible(
        5e-4, 0.0, 2e-2, f'{RV}; range derived: a degree is a gear that is broken'
    ),
    ('friction', 'windup'): Plausible(
        2e-4,
        0.0,
        5e-3,
        'derived: a loop of 10 Hz lets a robot joint trail by tenths of a milliradian; range '
        'derived: a third of a degree stops a motion',
    ),
    ('friction', 'asymmetry'): _even(
        0.2,
        0.6,
        'a servo axis trails by 11.8 um with 2.3 um between its two ways (recording EMPS, '
        'docs/transfer.md), 0.2; range derived: beyond, one way hardly rubs at all',
    ),
    ('friction', 'travel'): Plausible(
        1e-3,
        1e-6,
        2e-3,
        'derived: contacts of bearings and seals bend by micrometres on centimetres; a longer '
        'travel is a loop of the gear, hysteresis',
    ),
    ('hysteresis', 'amplitude'): Plausible(
        2e-4,
        0.0,
        3e-3,
        'loops of strain-wave joints are 20 arcsec to 1 arcmin wide at 2 % of their torque '
        '(robotics.zhinno.com, robot-joint-backlash-explained); range derived: a gear worn out',
    ),
    ('hysteresis', 'travel'): Plausible(
        0.1,
        2e-3,
        0.5,
        'derived: a shorter loop is a gap, backlash; a longer one a gear ratio that differs by '
        'direction',
    ),
    ('bearing_tilt', 'lean'): _even(
        2e-4, 3e-3, 'derived: two hundredths of a millimetre of run-out on a bearing of 0.1 m'
    ),
    ('bearing_tilt', 'second'): _even(
        1e-4, 1.5e-3, 'derived: an oval race leans less than one that is off centre; half of lean'
    ),
    ('loaded_play', 'width'): Plausible(5e-4, 0.0, 2e-2, f'{RV}; see backlash'),
    ('wear', 'rate'): _even(
        2e-6,
        1e-4,
        'derived: a tip that loses a millimetre in ten minutes; 6 mm in a minute is cut',
    ),
    ('wear', 'slowing'): Plausible(
        0.02,
        0.0,
        0.2,
        'derived: a sharp tip is blunt, and wears half as fast, after a minute or so; within some '
        'seconds it is chipped, not worn',
    ),
    ('joint_compliance', 'compliance'): Plausible(
        3e-5,
        -1e-5,
        3e-4,
        'derived: 3,000 N m/rad is the softest gear of a small cobot; a little below zero is a '
        'controller that mends too much',
    ),
    ('cartesian_compliance', 'compliance'): Plausible(
        5e-6, -1e-6, 1e-4, 'derived: 10 mm under 100 N is the softest arm that still welds'
    ),
    ('payload', 'mass'): _even(
        2.0, np.inf, 'derived: see `mass_range`; no arm carries half of what it weighs itself'
    ),
    ('payload', 'com'): _even(
        0.1, 0.5, 'derived: centres of torches and grippers lie within half a metre'
    ),
    ('hose_pull', 'force'): _even(
        20.0,
        200.0,
        'derived: as much as the load that a payload may be off by, 2 kg; range derived: ten '
        'times that lifts a small arm',
    ),
    ('hose_pull', 'stiffness'): _even(
        20.0, 200.0, 'derived: the same pull over a metre of way; a hose that pushes sags instead'
    ),
    ('pedestal_tilt', 'compliance'): Plausible(
        1e-5,
        -1e-5,
        1e-4,
        'a foundation shall swing above 30 Hz with the arm on it (ABB IRB 4400, 3HAC022032-001, '
        'p. 39, easymanua.ls): 1e-5 under a small arm of 3 kg m^2 about its foot; range derived: '
        'at 10 Hz it swings to the eye; see joint_compliance for the lower end',
    ),
    ('thermal_growth', 'coefficient'): Plausible(
        2.4e-5,
        -2.4e-5,
        7.2e-5,
        'aluminium alloys grow by 21.5e-6 to 23.8e-6 per K, cast iron by 11e-6 (amesweb.info); '
        'range derived: an arm may warm up three times as much as the place of the sensor',
    ),
    ('link_warm_up', 'strain'): Plausible(
        2.4e-4,
        -2.4e-4,
        1.2e-3,
        'aluminium alloys grow by 21.5e-6 to 23.8e-6 per K (amesweb.info); range derived: beside its '
        'motor a link gets 50 K warmer than it was, or 10 K cooler where a fan blows',
    ),
    ('link_warm_up', 'warming_time'): Plausible(
        np.inf,
        1.0,
        2e4,
        'derived: no metal warms within a second; beyond five hours it is the hall',
    ),
    ('drift', 'xyz_rate'): _even(
        5e-6,
        1e-4,
        'derived: 6 mm in a minute is a fixture that falls; trackers drift by tenths of a '
        'millimetre in two hours (akjournals.com, 606/15/3 p. 60)',
    ),
    ('measurement_scale', 'scale'): _even(
        1e-4,
        2e-3,
        'trackers are within 6 um/m across the beam (user manual of an AT9xx, section 2.8.2); '
        'range derived: 2 mm/m is a wrong length, not an instrument',
    ),
    ('refraction', 'warming'): _even(
        3.0,
        30.0,
        'in still air a line of sight bends by 0.2 mm over 12 m (0.008 in over 40 ft; Hamar Laser, '
        'Stealth series, appendix D, manualshive.com), 3 K/m; range derived: ten times that is air '
        'beside a furnace',
    ),
    ('quantization', 'step'): Plausible(
        1e-3, 0.0, 1e-2, 'derived: 12 bits a turn are 1.5 mrad; a centiradian is no encoder'
    ),
    ('servo_lag', 'time_constant'): Plausible(
        2e-2, 0.0, 0.3, 'derived: the loop of a machine that follows a path closes within 0.3 s'
    ),
    ('time_delay', 'delay'): _even(
        2e-2, 0.5, 'derived: buses and filters take milliseconds; half a second is another clock'
    ),
    ('clock_rate', 'rate'): _even(
        2e-5,
        1e-4,
        'oscillators are rated to 10 to 20 ppm (doi.org/10.1186/s40462-024-00512-7, table 1), a '
        'computer gained 14 ppm (ntp.org, NTP-s-sw-clocks-quality); range derived: what the checks '
        'of the data let pass as a clock',
    ),
    ('vibration', 'frequency'): Plausible(
        np.inf, 1.0, 100.0, 'derived: softer is a swing, stiffer does not reach the tool'
    ),
    ('vibration', 'damping'): Plausible(
        np.inf, 1e-3, 0.7, 'derived: steel rings longest at 0.001; beyond 0.7 nothing swings'
    ),
    ('vibration', 'gain'): _even(1.0, 5.0, 'derived: one is the whole inertia on one spring'),
    ('base_pose', 'xyz'): _even(5e-3, 0.5, 'derived: half a metre off is another place'),
    ('base_pose', 'rotvec'): _even(1e-2, 0.2, 'derived: ten degrees are seen by the eye'),
    ('root_pose', 'xyz'): _even(
        5e-3, 0.1, 'derived: a root that was measured by touch, or by hand'
    ),
    ('root_pose', 'rotvec'): _even(5e-3, 0.1, 'derived: five millimetres on a metre'),
    ('guide_bend', 'curvature'): _even(
        2e-4,
        5e-3,
        'derived: a rail laid to 0.1 mm on a metre; range derived: 2.5 mm on a metre is seen by the '
        'eye',
    ),
    ('guide_tilt', 'rate'): _even(
        2e-4, 5e-3, 'derived: rails laid to 0.1 mm on a metre, half a metre apart'
    ),
    ('tool_pose', 'xyz'): _even(
        5e-3,
        0.1,
        'tool centres found by hand were 8 to 15 mm off (industrialmonitordirect.com, KR3 '
        'mastering error)',
    ),
    ('tool_pose', 'rotvec'): _even(2e-2, 0.4, 'derived: twenty degrees are seen by the eye'),
    ('setup_settling', 'xyz'): _even(1e-3, 2e-2, 'derived: what a stand creeps while it warms'),
    ('setup_settling', 'rotvec'): _even(1e-3, 2e-2, 'derived: a millimetre on a metre'),
    ('setup_step', 'xyz'): _even(5e-3, 0.1, 'derived: a knock'),
    ('setup_step', 'rotvec'): _even(5e-3, 0.1, 'derived: a knock'),
    ('instrument_knock', 'xyz'): _even(5e-3, 0.1, 'derived: a knock'),
    ('instrument_knock', 'rotvec'): _even(5e-3, 0.1, 'derived: a knock'),
    ('tool_slip', 'xyz'): _even(5e-3, 0.05, 'derived: a holder or a nest that gave way'),
    ('tool_slip', 'rotvec'): _even(2e-2, 0.4, 'derived: a holder that gave way'),
    ('joint_slip', 'offset'): _even(
        5e-3, 0.13, 'derived: a tooth of a belt or the mark of a mastering; see joint_offset'
    ),
}
"""By effect and parameter."""
PRISMATIC: dict[tuple[str, str], Plausible] = {
    ('joint_offset', 'offset'): _even(5e-3, 0.1, 'derived: a reference switch, by hand'),
    ('joint_slip', 'offset'): _even(5e-3, 0.1, 'derived: a tooth of a belt or a rack'),
    ('transmission_ripple', 'amplitude'): _even(
        2e-5, 1e-3, 'derived: a turn of a screw repeats within hundredths of a millimetre'
    ),
    ('backlash', 'width'): Plausible(
        5e-5, 0.0, 5e-3, 'derived: nuts have hundredths of a millimetre of play'
    ),
    ('friction', 'windup'): Plausible(
        2e-5,
        0.0,
        1e-3,
        'a servo axis trails by 11.8 um (recording EMPS, docs/transfer.md); range derived: a '
        'millimetre is stuck',
    ),
    ('friction', 'travel'): Plausible(
        1e-4, 1e-7, 2e-4, 'derived: rolling guides bend by micrometres to a tenth of a millimetre'
    ),
    ('gear_ratio_by_direction', 'travel'): Plausible(
        1e-4, 1e-7, 2e-4, 'derived: as the travel of friction'
    ),
    ('hysteresis', 'amplitude'): Plausible(
        2e-5, 0.0, 1e-3, 'derived: guides and nuts lose hundredths of a millimetre'
    ),
    ('hysteresis', 'travel'): Plausible(
        1e-2, 2e-4, 0.05, 'derived: a shorter loop is a gap, a longer one a wrong scale'
    ),
    ('loaded_play', 'width'): Plausible(
        5e-5, 0.0, 5e-3, 'derived: nuts have hundredths of a millimetre of play'
    ),
    ('joint_compliance', 'compliance'): Plausible(
        1e-6, -1e-7, 1e-4, 'derived: 10 mm under 100 N is the softest axis'
    ),
    ('quantization', 'step'): Plausible(1e-5, 0.0, 1e-3, 'derived: a millimetre is no scale'),
}
"""The same where a joint slides, in m instead of rad."""
OWN_WEIGHT = 0.5
"""Share of its own weight that no arm carries; those of welding carry a tenth to a third."""
BELOW = 0.05
"""Share of an arm's own weight by which published masses of its links are off."""
UNSTATED_MASS = 20.0
"""Load [kg] taken as most where an arm's own masses are not known."""


def plausible(robot: Robot, effect: str, parameter: str, joint: str | None = None) -> Plausible:
    """
    Return spread and range of one parameter on a robot.

    Parameters
    ----------
    robot : Robot
    effect, parameter : str
    joint : str, optional
        Where the effect sits.

    Returns
    -------
    Plausible
        As wide as can be for what the table does not have.

    """
    key = (effect, parameter)
    found = TABLE.get(key, Plausible(np.inf, -np.inf, np.inf, 'derived: nothing is known'))
    if joint is not None and robot.prismatic[robot.index(joint)]:
        found = PRISMATIC.get(key, found)
    if key == ('payload', 'mass'):
        low, high = mass_range(robot)
        found = replace(found, low=low, high=high)
    return _narrowed(found, robot.plausible.get(effect, {}).get(parameter))


def mass_range(robot: Robot) -> tuple[float, float]:
    """
    Return how much less and more than declared a payload can weigh, [kg].

    A load cannot weigh less than nothing, and no arm carries half of what it weighs itself.
    """
    own = UNSTATED_MASS / OWN_WEIGHT if robot.mass is None else float(robot.mass.sum())
    return -robot.payload_mass - BELOW * own, OWN_WEIGHT * own - robot.payload_mass


def spreads(robot: Robot, effect: Effect) -> Array:
    """Return the prior standard deviation of every fit coordinate, shape (K,)."""
    if isinstance(effect, TransmissionRipple):
        each = plausible(robot, effect.name, 'amplitude', effect.site)
        # Sine and cosine share the amplitude.
        return np.full(effect.coordinates().size, each.sd / np.sqrt(2.0))
    return np.array([each.sd for each in _each(robot, effect)])


def ranges(robot: Robot, effect: Effect) -> tuple[Array, Array]:
    """Return the least and the most of every fit coordinate, each shape (K,)."""
    if isinstance(effect, TransmissionRipple):
        most = plausible(robot, effect.name, 'amplitude', effect.site).high
        full = np.full(effect.coordinates().size, most)
        return -full, full
    found = _each(robot, effect)
    return np.array([each.low for each in found]), np.array([each.high for each in found])


def beyond(robot: Robot, effect: Effect) -> list[tuple[str, float, float]]:
    """
    Return the parameters of an effect that no machine has, with value and nearest limit.

    Parameters
    ----------
    robot : Robot
    effect : Effect

    """
    out = []
    for (parameter, _), value in zip(effect.components(), effect.vector(), strict=True):
        each = plausible(robot, effect.name, parameter.name, effect.site)
        if not each.low <= value <= each.high:
            limit = each.low if value < each.low else each.high
            out.append((parameter.name, float(value), float(limit)))
    return out


def _each(robot: Robot, effect: Effect) -> list[Plausible]:
    specs = effect.components()
    return [plausible(robot, effect.name, specs[k][0].name, effect.site) for k in effect.fitted()]


def _narrowed(found: Plausible, given: Mapping[str, float] | None) -> Plausible:
    """Return what a robot file says instead, as far as it says anything."""
    if not given:
        return found
    return Plausible(
        float(given.get('sd', found.sd)),
        float(given.get('low', found.low)),
        float(given.get('high', found.high)),
        'the robot file',
    )

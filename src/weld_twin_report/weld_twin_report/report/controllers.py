# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Where a controller takes a correction, in the words of its menus and the numbers that it wants."""

from weld_twin_core.arm.robot import Robot
from weld_twin_core.effects.effect import Effect
from weld_twin_core.effects.geometry import RootPose
from weld_twin_core.effects.wording import further

BRANDS = {
    'abb': 'ABB',
    'fanuc': 'FANUC',
    'kuka': 'KUKA',
    'ur': 'UR',
    'yaskawa': 'Yaskawa',
}
"""By the start of a robot's name, as the bundled models and most URDFs have it."""
_PROGRAM = (
    'The controller has no field for it: correct the points of the program (weld-twin correct).'
)
UNNAMED = (
    'No field before the cause is known; so long, correct the points of the program (weld-twin '
    'correct).'
)
"""Of a curve: a joint that is off alike everywhere need not be so for its zero."""
_PLACES = {
    'kuka': {
        'zero': 'Start-up > Master: $MAMES of the axis, in degrees: new value = old value '
        '{degrees}; then master the axis at its notch.',
        'base': 'Start-up > Calibrate > Base: change BASE_DATA[n], or $ROBROOT of the cell.',
        'root': 'Start-up > Calibrate > External kinematic system > Root point (numeric): ROOT of'
        ' MACHINE_DEF[n] in the world.',
        'tool': 'Start-up > Calibrate > Tool: change TOOL_DATA[n].',
        'load': 'Start-up > Calibrate > Tool > Payload data: change LOAD_DATA[n].',
    },
    'abb': {
        'zero': 'Calibration > Calib. parameters: motor calibration offset of the axis, in '
        'radians of the motor: new value = old value {radians_back} * G, where G is '
        'radians of the motor per radian of the joint, with its sign.',
        'base': 'Change wobj.uframe of the work object, or Base Frame in the topic Motion.',
        'root': 'Base Frame of the positioner, such as that of orbit_a, in the world (topic '
        'Motion, type Single; of two axes that are one unit, Robot).',
        'tool': 'Change tframe of the tooldata.',
        'load': 'Change the loaddata, or run LoadIdentify.',
    },
    'fanuc': {
        'zero': 'MENU > SYSTEM > Master/Cal > Single axis master: MSTR POS of the axis, in '
        'degrees: new value = what it reads now {degrees}; then EXEC, without moving it '
        'before.',
        'base': 'MENU > SETUP > Frames: change the user frame UFRAME[n].',
        'root': 'MENU > SETUP > Coord: frame of the leader of the coordinated pair, in the world '
        'of the robot.',
        'tool': 'MENU > SETUP > Frames: change the tool frame UTOOL[n].',
        'load': 'MENU > SYSTEM > Motion: change the payload schedule.',
    },
    'yaskawa': {
        'zero': 'ROBOT > HOME POSITION: absolute data of the axis, in pulses: new value = old '
        'value {degrees_back} * P, where P is pulses per degree, with its sign: turn the '
        'axis by +10 deg, read by how many pulses its position grows, and divide.',
        'base': 'ROBOT > USER COORDINATE: teach or change the user frame.',
        'tool': 'ROBOT > TOOL: change X, Y, Z, Rx, Ry, Rz of the tool file.',
        'load': 'ROBOT > TOOL: change weight and centre of gravity of the tool file.',
    },
    'ur': {
        'zero': 'By a new kinematic calibration, which a service engineer makes. delta_theta of '
        'the joint in calibration.conf, in radians: new value = old value {radians}; the '
        'readings stay, and the pose that is shown moves.',
        'model': 'By a new kinematic calibration, which a service engineer makes. It stands as a '
        'delta of the link in calibration.conf of the controller.',
        'base': 'Installation > Features: change the feature that the program moves in.',
        'tool': 'Installation > General > TCP: change position and orientation.',
        'load': 'Installation > General > Payload: change mass and centre of gravity.',
    },
}
"""Menus as they are usually called. docs/sheet.md tells which names were found where."""
_BY_MODEL = ('ur',)
"""Makers whose controllers keep an error of a zero in their model: the readings stay as they are."""
_RATIO = (
    'Where the controller has a field for ratios of gears; else correct the points of the program '
    '(weld-twin correct).'
)
_ANYWHERE = {
    'zero': 'As the zero of this axis, by mastering it anew: new reading = old reading {far}, with '
    'the joint left where it is',
    'base': 'As the frame of the base or of the work object',
    'root': "As the frame where the positioner stands in the robot's base",
    'tool': 'As the tool centre point',
    'load': 'As the payload',
    'model': 'In the kinematic model, where the controller has one that can be edited; else correct '
    'the points of the program (weld-twin correct)',
}
"""What takes a correction at any controller, by the kind of the error."""
_CHECK = (
    'It was right if the reading where the joint stands went from X to X {far}, and the wrong way '
    'round if to X {back}.'
)
"""What shows that a zero was entered the right way, wherever the readings change by it."""
UNCHECKED = (
    'The way through the menus was not checked against a manual; names differ by version of the '
    'controller.'
)
"""Said wherever a menu is named."""


def brand_of(robot: str) -> str | None:
    """Return the brand whose robots are named like this, None where the name does not tell."""
    name = robot.lower().replace('motoman', 'yaskawa')
    return next((brand for brand in BRANDS if name.startswith(brand)), None)


def correction(effect: Effect, brand: str | None, robot: Robot | None = None) -> str:
    """Return where this maker's controller takes the correction, or why there is nothing to enter."""
    kind = effect.traits.entered
    if kind == 'ratio':
        return _RATIO
    if kind not in _ANYWHERE and kind != 'program':
        return f'Nothing to enter: {_instead(effect)}.'
    sliding = (
        robot is not None
        and effect.site in robot.joint_names
        and bool(robot.prismatic[robot.index(str(effect.site))])
    )
    off = _off(effect, sliding)
    # The makers' fields of a zero are angles; what a slide's count is not known.
    if kind in _ANYWHERE and (brand is None or (sliding and kind == 'zero')):
        step = _ANYWHERE[kind].format(**off)
        return step + (
            '.' if brand else '; --controller with the name of its maker tells the menu.'
        )
    place = _PLACES.get(str(brand), {}).get(kind)
    if place is None:
        return _PROGRAM
    if isinstance(effect, RootPose) and robot is not None:
        # Programs bring the planning of motions: a second that an arm on a floor need not wait.
        from .root_frame import old_and_new

        return f'{place} {old_and_new(effect, str(brand), robot)} {UNCHECKED}'
    check = _CHECK if kind == 'zero' and brand not in _BY_MODEL else ''
    place = f'{place} {check}'.format(**off).rstrip()
    return f'{place} {UNCHECKED}' if ' > ' in place else place


def _instead(effect: Effect) -> str:
    """Return what an error is a matter of where a controller has nothing to enter for it."""
    if not effect.traits.entered:
        return 'no field of a controller is known for it'
    if effect.traits.place in ('instrument', 'clock'):
        return f'the robot is not at fault, but how it was recorded: {effect.traits.entered}'
    return f'a matter of {effect.traits.entered}'


def gearing(effect: Effect) -> str:
    """Return what shows that a ratio of a gear was entered the right way; nothing for another effect."""
    if effect.name != 'gear_ratio':
        return ''
    return 'Measure again: the wrong way round doubles the error.'


def _off(effect: Effect, sliding: bool) -> dict[str, str]:
    """Return how much further than its reading a joint stands, in what controllers count in."""
    offset = float(getattr(effect, 'offset', 0.0))
    far, back = (further(value, sliding=sliding) for value in (offset, -offset))
    radians, radians_back = (
        f'{"-" if value < 0.0 else "+"} {abs(value):.6f}' for value in (offset, -offset)
    )
    return {
        'far': far,
        'back': back,
        'degrees': far.removesuffix(' deg'),
        'degrees_back': back.removesuffix(' deg'),
        'radians': radians,
        'radians_back': radians_back,
    }

# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Every number by which the gate decides, with its meaning, its unit and where it comes from.

Two kinds of error are kept apart. What an arm can have (a zero off by tenths of a degree, links
off by a millimetre, play, springs, lag) is a cause, and a diagnosis looks for it. What no arm can
have (degrees for radians, two joints swapped, another arm) is a mistake in the set-up, and stops
the diagnosis. The numbers below lie between the two, with room on both sides; the proof
``weld-twin lab gate`` measures that room.
"""

LARGE = 1e-3
"""
Median gap [m] that frames and a plausible arm leave, from which mistakes are looked for.

Play, ripple, lag and springs of an arm in use leave tenths of a millimetre; the smallest mistakes
(a sibling arm, a sign on a joint that moves by one degree) leave some millimetres.
"""
EXPLAINED = 5.0
"""
Factor by which undoing a mistake must bring down what is wrong.

Undoing a real one brings centimetres to the noise (factors of 100 and more); undoing one that is
not there by chance never did better than 2 on sound recordings.
"""
WORTH = 0.7
"""A further mistake must bring what is wrong below this share of what it was."""
MOST = 3
"""So many mistakes at once are looked for; more never came together by accident."""
SHORTLIST = 5
"""So many of the roughly best mistakes are fitted in full; the right one was always among two."""
UNEXPLAINED = 0.01
"""Median gap [m] that frames and a plausible arm leave, from which nobody can use the data."""

OFFSET_SPREAD, LINK_SPREAD, TWIST_SPREAD = 0.01, 1.5e-3, 5e-3
"""
Spread of what the zeros [rad], lengths [m] and twists [rad] of a plausible arm are off by.

Wide on purpose: arms as delivered are off by tenths of a milliradian to some milliradians and by
tenths of a millimetre (the two arms of docs/real_robots.md: 2 to 3 mm at the tool in all).
"""
OFFSET_MOST, LINK_MOST, TWIST_MOST = 0.09, 6e-3, 0.03
"""
Errors [rad, m, rad] beyond which a number is no arm's error but another number.

A zero lost by one tooth or one mastering notch is off by less than 5 degrees; links are machined
to hundredths of a millimetre, and those of sibling arms differ by 5 to 30 mm.
"""
SOFT = 2e-4, 4e-4
"""Noise [m, rad] that trial fits assume at least, so that the spreads above have weight."""

FAR = 0.05
"""
Median gap [m] from which given frames are not off but another instrument's.

A frame that was measured is off by millimetres; 50 mm at the tool is a frame that never was.
"""
TURNED = 0.035
"""Angle [rad] within which a base is turned by a quarter or half turn, and not by anything."""
BESIDE = 0.1
"""Distance [m] within which a turned base still stands where it was given."""

LATE = 0.1
"""
Lag [s] from which stamps are of another clock.

Streams through one computer are tens of milliseconds apart, drives lag by as much (the servo axis
of EMPS: 6.5 ms); clocks that nobody synchronised are off by anything.
"""
RATE = 1e-4
"""
Rate at which two clocks may run apart.

A cheap quartz is within 100 ppm; more is stamps made by something else than a clock.
"""

STILL_SPEED = 1e-12
"""Velocity [rad/s, m/s] below which a stream says zero; sensors at rest show noise, not zero."""
MOVED = 0.02
"""Motion [rad, m] in a stream from which zero velocities cannot be true."""
LIKE_LENGTH = 0.8
"""
Share of the longer stream that the shorter one must last for the two to have begun together.

Streams of one recording are started by one command and differ by seconds of some tens.
"""

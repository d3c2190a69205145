# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Every number by which the gate decides, with its meaning, its unit and where it comes from.

Two kinds of error are kept apart. What an arm can have (a zero off by tenths of a degree, links
off by a millimetre, play, springs, lag) is a cause, and a diagnosis looks for it. What no arm can
have (degrees for radians, two joints swapped, another arm) is a mistake in the set-up, and stops
the diagnosis. The numbers below lie between the two, with room on both sides; the proof
``weld-twin lab gate`` measures that room.
"""

TINY = 1e-9
"""What is less is rounding: metres, radians, seconds, and shares of what it is compared with."""
NOISE = 5e-5
"""Gap [m] that is the noise of a good tracker: below it nothing is looked for in tools and stamps."""
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
HALVED = 2.0
"""
The same where other errors stay: loads and play beside other lengths of links, beside a tool of each
recording's own, beside even stamps; or where undoing it also brings joints back into their range.

Of sound pairs of recordings tools of their own took off a tenth, of sound arms other lengths a
quarter; even stamps of a buffered tracker brought 126 mm to 0.3 mm.
"""
UNDONE = 4e-3
"""
Median gap [m] that a plausible arm may leave once a mistake is undone.

Play, ripple, lag and springs leave up to 2 mm; of rows that do not belong together any turn of a
joint may by chance leave a fifth, and still centimetres.
"""
BEYOND = 1.0
"""Reading [rad, m] beyond a joint's range that no controller gives, whatever its zero."""
WORTH = 0.7
"""A further mistake must bring what is wrong below this share of what it was."""
MOST = 3
"""So many mistakes at once are looked for; more never came together by accident."""
UNLIKE = 6.0
"""
Factor by which measured positions may spread less than the flange of the arm moves.

A long tool makes a small motion large, or takes part of it back; units differ by 25 and more.
"""
SHORTLIST = 5
"""So many of the roughly best mistakes are fitted in full; the right one was always among two."""
UNEXPLAINED = 0.01
"""Median gap [m] that frames and a plausible arm leave, from which nobody can use the data."""

OFFSET_SPREAD, LINK_SPREAD, TWIST_SPREAD = 0.01, 1.5e-3, 5e-3
"""
Spread of what the zeros [rad], lengths [m] and twists [rad] of a plausible arm are off by.

Wide on purpose: arms as delivered are off by tenths of a milliradian to some milliradians and by
tenths of a millimetre (the two arms of docs/real_arms.md: 2 to 3 mm at the tool in all).
"""
OFFSET_MOST, LINK_MOST, TWIST_MOST = 0.13, 8e-3, 0.03
"""
Errors [rad, m, rad] beyond which a number is no arm's error but another number.

Arms mastered on wrong marks were up to 7 degrees off (see `effects.plausible`); links are machined
to hundredths of a millimetre, and those of sibling arms differ by 5 to 30 mm. Links count together,
by the root of the sum of their squares: a sibling differs in several of them.
"""
ROOT_SPREAD, ROOT_MOST = 0.05, 0.1
"""
Spread, and the most [m, rad], of where a positioner stands beside a robot.

Roots come from drawings, or were touched by hand; the most is that of `effects.plausible`.
"""
SIBLING = 4e-3
"""
RMS motion [m] of the tool by wrong lengths of links, from which they are those of another arm.

The two arms of docs/real_arms.md are off by 2 to 3 mm in all, most of it by their zeros; arms of
one family differ by 5 to 30 mm.
"""
LINKS_APART = LINK_SPREAD, 0.02
"""Spreads [m] of lengths that are tried in turn: within a family, and of an arm of another size."""
SOFT = 2e-4, 4e-4
"""Noise [m, rad] that trial fits assume at least, so that the spreads above have weight."""

FAR = 0.05
"""
Median gap [m] from which given frames are looked at: below, they are plausible in any case.

Whether they are a cause then is for `effects.plausible`, `base_pose` and `tool_pose`, to say.
"""
TILTED = 0.17
"""Angle [rad] within which a base counts as upright and gravity as pulling down: floors and levelled
instruments are better by far, arms that are tilted on purpose are at 15 degrees and more."""
TURNED = 0.035
"""Angle [rad] within which a base is turned axis onto axis, and not by anything."""
BESIDE = 0.1
"""Distance [m] within which a turned base still stands where it was given."""

LATE = 0.2
"""
Lag [s] from which stamps are of another clock.

Streams through one computer are tens of milliseconds apart, drives lag by as much (the servo axis
of EMPS: 6.5 ms); clocks that nobody synchronised are off by anything.
"""
LATE_LEFT = 1e-2
"""Gap [m] that a lag must leave at most: more, and something else is wrong that a lag imitates."""
BY_ITSELF = 2e-3
"""Gap [m] that a sound arm leaves by itself, moving or at rest: play, ripple, lag and springs."""
LATE_WORTH = 0.6
"""
Share of what the errors of a sound arm would leave, RMS, that a lag must stay below there.

Where play, loops and ratios explain the gap as well, both leave noise: a share of 1. A judgement.
"""
RATE = 1e-4
"""
Rate at which two clocks may run apart.

A cheap quartz is within 100 ppm; more is stamps made by something else than a clock.
"""

RATE_MOST = 0.1
"""Rate beyond which it is no clock: rows that do not belong together look like that."""

HELD = 0.03
"""Gap over the widest motion of a joint [m/rad] below which a tool that never moves is held: a joint
alone would move it by a lever of half a metre, and arms are off by some millimetres."""
MOVED = 0.02
"""Motion [rad, m] of a joint that hardly moves: it shows next to nothing, and less may be at rest."""
STUCK_LEAST, STUCK_STATIONS = 0.5, 4
"""Shortest stretch, in s or in stations, in which readings that stand still are looked at."""
STUCK_AFTER = 0.3
"""Seconds that an arm may go on after its command stands still: lag and settling."""
STUCK_STRAYS = 0.1
"""Share of the measurements of a standing stretch, one at least, that may lie anywhere: instruments have
strays, and a tool that moves on is elsewhere in all the others too."""
STUCK_EXPLAINED = 4.0
"""Factor by which the gap there is larger than elsewhere, and than with the joint set free."""
LIKE_LENGTH = 0.8
"""
Share of the longer stream that the shorter one must last for the two to have begun together.

Streams of one recording are started by one command and differ by seconds of some tens.
"""

DATED, DATED_MOVING = 6.0, 20.0
"""
Nats by which a step must beat no step, on stations and on a moving arm.

The residuals of a moving arm hang together however good the model; see `changed`.
"""
MARGIN = 10.0
"""Nats by which a step must beat every smooth change of anything."""
NEARLY = 0.9
"""Share of what a step of more numbers explains that one of fewer must explain to be taken."""
LEFT_ALIKE = 2.0
"""
What it may leave, in squares, as a multiple of what the one of more numbers leaves.

Where play or springs are at work both leave much the same; a wrong place leaves ten times as much
and more.
"""
DATED_SIZE = 2.5
"""
A step this many times as large as the largest gaps did not happen: one frame that is fitted takes
up half of it, base and tool together a little more.
"""
DATED_SHARE = 0.1
"""
Share of the squares that frames and a plausible arm leave which a step must explain.

Effects that no formula holds exactly leave small steps here and there; what gave way is seen.
"""
ENDS = 0.05
"""Share of a recording at its ends in which a step cannot be told from the end's own troubles."""
MOST_SLIPS = 4
"""So many changes in time are taken out in turn."""

COMPUTED = 2e-6
"""
Gap [m] that a rigid arm leaves of computed poses at most: a fifth of what the best tracker repeats.

Numbers of 32 bits leave 1e-7. Of the real arms under a tracker a rigid arm left 50e-6 and more.
"""
ROUNDED = 1e-5
"""The same [m] where the numbers were rounded, and rounding alone explains what is left."""

PARTED_TURN = 0.01
"""Turn [rad] that an arm leaves of orientations below which no tool is looked at: zeros and twists of
an arm as delivered turn the tool by some milliradians."""
IMAGE_FAR = 1.5
"""
Noise of a pixel [px] from which images are looked into.

Corners of boards are found within 0.05 to 0.5 px, circles of markers within 1 px.
"""
IMAGE_UNDONE = 0.5
"""Share of that noise that undoing a mistake of cameras or targets may leave."""
IMAGE_ALIKE = 1.1
"""Share of that noise that is as good as it was: lenses that follow leave as much."""
LENS_DOUBT = 4.0
"""How far a lens may be from its calibration, in the spreads below, before it is looked into."""
LENS_FAR = 8.0
"""
How far a lens may be from its calibration, in spreads between calibrations of one lens.

Calibrations with few images of a board are off by two or three of them; another lens, or another
zoom, by ten and more.
"""
BEHIND = 0.8
"""Share of the images in which a board must show its back; of small ones, some seem to lean over."""
TARGET_SCALE = 6e-3
"""
Share by which all that cameras measure may be too large for the way of the arm.

Links off by some millimetres in a metre make half of it; a printer that fits the page makes 2 % and
more.
"""
TARGET_EXPLAINS = 0.5
"""Share of the squared gap that it must explain."""

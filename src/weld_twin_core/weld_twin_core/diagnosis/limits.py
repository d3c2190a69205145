# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Every number by which the gate decides, with its meaning, its unit and where it comes from.

What an arm can have (a zero off by tenths of a degree, links off by a millimetre, play, springs, lag)
is a cause; how large that can be says `effects.plausible`. What no arm can have (degrees for radians,
two joints swapped, another arm) is a mistake in the set-up, and stops the diagnosis. The numbers lie
between the two, with room on both sides, which the proof ``weld-twin lab gate`` measures.

A mistake is believed where undoing it makes what is wrong several times smaller, and nothing else does
as well: `CLEAR`, `HALVED`, `WORTH`. What is left is compared with what an arm in use leaves: `NOISE`,
`LARGE`, `SOUND`, `UNDONE`, `UNEXPLAINED`, `FAR`. A few samples may be anything: `FEW`, `ENOUGH`,
`STRAY`.
"""

TINY = 1e-9
"""What is less is rounding: metres, radians, seconds, and shares of what it is compared with."""

# How much better ---------------------------------------------------------------------------------

CLEAR = 5.0
"""Factor by which undoing a mistake must bring down what is wrong. Undoing a real one brings
centimetres to the noise (factors of 100 and more); undoing one that is not there by chance never did
better than 2 on sound recordings."""
HALVED = 2.0
"""The same where other errors stay: loads and play beside other lengths of links, beside a tool of each
recording's own, beside even stamps; or where undoing it also brings joints back into their range. Of
sound pairs of recordings tools of their own took off a tenth, of sound arms other lengths a quarter;
even stamps of a buffered tracker brought 126 mm to 0.3 mm."""
WORTH = 0.7
"""A further mistake must bring what is wrong below this share of what it was; another one that leaves
no more than the best over this share does as well."""
MARGIN = 10.0
"""Log Bayes factor by which a change at an instant must beat every smooth change, and none at all; on a
moving arm twice as much."""

# How much is left --------------------------------------------------------------------------------

NOISE = 5e-5
"""Gap [m] that is the noise of a good tracker: below it nothing is looked for in tools and stamps."""
LARGE = 1e-3
"""Median gap [m] that frames and a plausible arm leave, from which mistakes are looked for. Play,
ripple, lag and springs of an arm in use leave tenths of a millimetre; the smallest mistakes (a sibling
arm, a sign on a joint that moves by one degree) leave some millimetres."""
SOUND = 2.0 * LARGE
"""Gap [m] that a sound arm leaves by itself, moving or at rest: play, ripple, lag and springs."""
UNDONE = 2.0 * SOUND
"""Median gap [m] that a plausible arm may leave once a mistake is undone, and motion of the tool by
wrong lengths from which they are those of another arm. Of rows that do not belong together any turn of
a joint may by chance leave a fifth, and still centimetres. The two arms of docs/real_arms.md are off by
2 to 3 mm in all, most of it by their zeros; arms of one family differ by 5 to 30 mm."""
UNEXPLAINED = 0.01
"""Median gap [m] that frames and a plausible arm leave, from which nobody can use the data."""
FAR = 0.05
"""Median gap [m] from which given frames are looked at: below, they are plausible in any case. Whether
they are a cause then is for `effects.plausible`, `base_pose` and `tool_pose`, to say. A tool that never
moves is held where the gap is less than this for each radian or metre of a joint: alone it would move
the tool by a lever of half a metre."""
WIDER = 3.0
"""An arm is plausible in a trial with errors this many times as large as those of machines at large."""
COMPUTED = 2e-6
"""Gap [m] that a rigid arm leaves of computed poses at most: a fifth of what the best tracker repeats.
Numbers of 32 bits leave 1e-7. Of the real arms under a tracker a rigid arm left 50e-6 and more. Where
numbers were rounded it may be as much as `CLEAR` times this, if rounding explains it."""

# Angles ------------------------------------------------------------------------------------------

PARTED = 0.01
"""Turn [rad] that an arm leaves of orientations below which no tool is looked at: zeros and twists of
an arm as delivered turn the tool by some milliradians."""
WRONG = 0.05
"""Median angle [rad] from which orientations do not belong to the joints."""
TILTED = 0.17
"""Angle [rad] within which a base counts as upright and gravity as pulling down: floors and levelled
instruments are better by far, arms that are tilted on purpose are at 15 degrees and more."""

# Samples -----------------------------------------------------------------------------------------

FEW = 0.1
"""Share of samples that may be anything: strays, messages that were lost, the ends of a recording.
Instruments have strays; what is wrong with a recording is wrong with most of it."""
ENOUGH = 20
"""Samples below which nothing is said of their scatter, and stations with which few causes can be
told apart: sixty coordinates for the some thirty of a geometric fit."""
STRAY = 8.0
"""Robust spreads from which something is no chance: a reading, a touch, a lens. Of normal errors one
in ten million is so far off; errors of gears are bounded."""
RUN = 4
"""Stations in a row at the least that tell of what happened between them."""
MOVED = 0.02
"""Motion [rad, m] of a joint that hardly moves: it shows next to nothing, and less may be at rest."""

# Clocks ------------------------------------------------------------------------------------------

LATE = 0.2
"""Lag [s] from which stamps are of another clock. Streams through one computer are tens of milliseconds
apart, drives lag by as much (the servo axis of EMPS: 6.5 ms), an arm settles within it; clocks that
nobody synchronised are off by anything."""

# How long it is looked ---------------------------------------------------------------------------

MOST = 3
"""So many mistakes at once, or changes in time in turn, are looked for; more never came together by
accident."""
SHORTLIST = 5
"""So many of the roughly best mistakes are fitted in full; the right one was always among two."""
STEPS = 6
"""Gauss-Newton steps of a trial, from where a closed form or a linear fit began."""
SAMPLES = 60
"""Samples of a trial in all: enough for every error of an arm, few enough for fits at once."""

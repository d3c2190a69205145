# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Where a corrected model holds, in sentences for its files, the page and the terminal."""

from __future__ import annotations

from weld_twin_core.diagnosis.algebra.model import Alone
from weld_twin_core.twin.posterior import Posterior

AS_GOOD = 1.1
"""Ratio of what a robot file leaves to what the whole model leaves up to which either may be taken: less
is a matter of the stretches left out."""
NOTHING_KNOWN = 3e-3
"""Spread [m] from which a model knows nothing of a place: an arm as delivered is off by no more."""
_BESIDES = 'noise and what no parameter explains come on top'


def where_it_holds(posterior: Posterior) -> list[str]:
    """Return how far a model can be relied on, what was left open, and where it was measured."""
    recorded, anywhere = (
        f'{v * 1e3:.2g} mm' for v in (posterior.recorded_m, posterior.anywhere_m)
    )
    out = [
        f'The whole model is known to {recorded} where it was measured (one standard deviation), and '
        f'nothing is known of elsewhere in its reach: the postures are too alike; {_BESIDES}.'
        if posterior.anywhere_m > NOTHING_KNOWN
        else f'The whole model is known to {recorded} where it was measured, but only to {anywhere} '
        f'elsewhere in its reach (one standard deviation each); {_BESIDES}.'
        if anywhere != recorded
        else f'The whole model is known to {recorded} (one standard deviation); {_BESIDES}.'
    ]
    out += left_open(posterior)
    return [*out, 'Measured at ' + '; '.join(posterior.domain.sentences()) + '.']


def elsewhere(posterior: Posterior, corrected: bool) -> str:
    """
    Return that what is said holds where it was measured, in a sentence, and how wide it is beyond.

    How far it is off where it was measured is what is left of the gap, which is told as that. What
    is told of elsewhere is of the ``corrected`` robot, and of no other.
    """
    if not corrected:
        return 'All this holds where it was measured, and says nothing of elsewhere in its reach.'
    if posterior.region is not None:
        region, sigma = posterior.region
        return (
            f"In the region '{region}' the corrected robot may still be off by {sigma * 1e3:.2g} mm "
            '(one standard deviation); weld-twin investigate --tolerance MM --model diagnosis.json '
            '--region says what to measure there.'
        )
    if posterior.anywhere_m > NOTHING_KNOWN:
        return (
            'All this holds where it was measured. Of elsewhere in its reach these recordings tell '
            'nothing: the postures are too alike. Measure there before you weld there.'
        )
    return (
        'All this holds where it was measured. Elsewhere in its reach the corrected robot may still '
        f'be off by {posterior.anywhere_m * 1e3:.2g} mm (one standard deviation): measure there '
        'before you weld there.'
    )


def file_alone(alone: Alone, *, left: bool) -> list[str]:
    """
    Return what a robot file leaves by itself, beside the whole model, in sentences for its head.

    ``left``: whether the model has effects that the file cannot hold.
    """
    by_itself = (
        f'{_mm(alone.recorded_m)} where it was recorded and {_mm(alone.unseen_m)} on data that were '
        'not fitted'
    )
    if not left:
        return [f'This file holds all that was found, and leaves {by_itself} (RMS).']
    out = [
        f'This file alone leaves {by_itself} (RMS). The whole model (diagnosis.json, or this file '
        f'with robot_effects.yaml) leaves {_mm(alone.whole_recorded_m)} and '
        f'{_mm(alone.whole_unseen_m)}.'
    ]
    if alone.changes:
        out.append(
            'Its constants were fitted once more for use without the effects that it cannot hold, '
            'and are not those of the page; robot_effects.yaml takes the difference back.'
        )
    return out


def which_file(alone: Alone | None) -> str:
    """Return which file to take, in a sentence; nothing where all do as well, or it is not known."""
    if alone is None or alone.unseen_m < AS_GOOD * alone.whole_unseen_m:
        return ''
    return (
        'Take diagnosis.json (weld-twin correct): it leaves '
        f'{_mm(alone.whole_unseen_m)} on data that were not fitted. robot.yaml and robot.urdf '
        f'cannot hold all that was found, and leave {_mm(alone.unseen_m)} by themselves.'
    )


def _mm(length: float) -> str:
    return f'{length * 1e3:.3f} mm'


def left_open(posterior: Posterior) -> list[str]:
    """Return the directions that the recordings left open, in one sentence or none."""
    if not posterior.left_open:
        return []
    count = len(posterior.left_open)
    named = 'direction of the frames is' if count == 1 else 'directions of the frames are'
    return [
        f'{count} {named} left open by the recordings, and as given as far as the data bear that: '
        f'{"; ".join(posterior.left_open)}.'
    ]

# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Most tuned numbers that decide a verdict; `calibration/weights.json` has those of probabilities."""

from __future__ import annotations

from dataclasses import dataclass

SHORTLIST = 6
"""Candidates that are tried in full at every step, where a quick ranking may mislead; of groups without
a formula the right one was within four."""
CAUSES = 6
"""Causes of a cell at the most: of more at once nothing simple can be said."""


@dataclass(frozen=True)
class Beliefs:
    """
    What a diagnosis believes before it sees data, as numbers.

    Each field says what it means, its unit, and where its value comes from. The numbers by which
    data are refused as unsound lie in `limits`.

    Examples
    --------
    >>> from dataclasses import replace
    >>> import weld_twin_core as wt
    >>> careful = replace(wt.Beliefs(), sure=0.95)  # name a cause alone only from 95 % on
    >>> careful.sure
    0.95

    """

    # Which effects are found -----------------------------------------------------------------

    enter_log_bayes: float = 6.0
    """Log Bayes factor that an effect must be worth to enter and to stay: about 400 to 1,
    for a hundred or so candidates of which any may enter by chance."""
    close_log_bayes: float = 8.0
    """Log Bayes factor below the best within which a candidate is fitted as well: the linear
    ranking is a quadratic expansion, and misjudges a response that bends."""
    invisible: float = 0.12
    """RMS change of the residual [noise] below which a lone effect is not worth a name, however
    many rows vouch for it; of one beside a larger one twice as much is not told from that one's
    misfit. A judgement."""
    hope: float = 0.3
    """Exponent by which autocorrelation is believed while causes are still missing, 0 to 1: the
    residual is then the causes' own, and looks far more correlated than the noise is."""
    misfit: float = 0.012
    """Share of an effect's amplitude by which its formula errs on a real arm: edges are soft,
    springs harden, lags have a second pole. A judgement."""
    misfit_directions: float = 30.0
    """Number of directions among all columns that such a misfit spreads over. A judgement."""
    alternative_log_bayes: float = 15.0
    """Log Bayes factor below the best within which another effect is fitted as an alternative."""
    alternative_share: float = 0.35
    """The same as a share of the best."""
    temperature: float = 2.0
    """Evidence between alternatives is divided by this: real physics is a little richer than any model
    compared, so a nat is worth half of what it counts. A judgement."""

    # Many small errors at once ---------------------------------------------------------------

    many: int = 8
    """Effects found one by one on stations from which on they are many small ones acting together.
    A judgement."""
    several: int = 4
    """Effects found on stations from which on the many are tried as well, and taken if they
    predict unseen stations better. A judgement."""
    better: float = 0.95
    """RMS on unseen stations, as a share of that of the few, that the many must stay below. A
    judgement."""
    wave_range: float = 1.0
    """Travel [rad] of a joint from which on its waves differ from their neighbours' orders: over
    less than a sixth of a turn, orders that differ by six look alike."""
    line_chi2: float = 25.0
    """Chi-square of two degrees of freedom that a single line must reach: chance reaches it once
    in 270000 looks, and some 2000 are taken."""
    setup_chi2: float = 60.0
    """Chi-square of six degrees of freedom that a motion of the set-up must reach over some 40
    looks. Chance reaches 25 once in 3000 looks; the rest is a judgement, as what no model of the
    arm has looks like a motion of the set-up too."""
    family_worth: float = 0.1
    """Share by which the RMS error on unseen data grows without a kind, in the median part left out,
    from which on the kind is named; a tenth is what a calibration is worth doing for. As large a
    share of a kind a joint must have to be reported."""

    # What unseen data say --------------------------------------------------------------------

    dependence_gain: float = 0.02
    """Share of the squared unseen error from which what a generic column explains is reported."""
    steady: float = 2.0
    """What unseen folds gain over its standard error between them, from which on it counts: one
    chance in forty for each that is looked at."""
    other_setup: float = 5.0
    """Times by which a held-out recording must fit better with a frame of its own to stem from
    another set-up. A judgement."""
    farthest: float = 1.0
    """Logarithm of a ratio between two motions from which on it says no more about the interval:
    a model that leaves e times as much elsewhere fits neither."""

    # The verdict -----------------------------------------------------------------------------

    sure: float = 0.85
    """Share of the evidence from which on one name stands alone; not the `sure` of an answer."""
    listed: float = 0.03
    """Probability from which on an alternative is named beside a leader that is not sure."""
    unexplained: float = 0.05
    """Share that is little. So much of the squared gap may stay unexplained before it is reported as
    something left, and before the answer is 'unknown' where nothing was found; more of the squared
    error a group without a formula must take away to be one of the few. An alternative that leaves
    no more than this beyond the effect in the model is its like; and a gap counts as standing at
    least so much of the squared floor above it. On 8 development cases (seed 424202) with causes
    outside the library 0.02 to 0.05 found the same groups; below, a large gap lost its second."""
    above: float = 1.3
    """What remains must exceed an independently measured floor by this factor to count; the
    floor itself is known to a tenth or so, and noise has tails. A floor that only the fit shows may
    be too low by it besides: with its square two causes outside the library (seed 515001), 1.9 and
    2.6 times their floor, are no noise."""
    structure_gain: float = 0.03
    """Share of the squared unseen error that a structure must take away to count."""
    structure_sure: float = 3.0
    """What it must take away besides, in standard errors between folds."""
    blatant_sure: float = 1.5
    """Standard errors that a structure must take away which is a large one (`beaten_share`): few folds
    may hold all of it."""

    # Place, dependence and name --------------------------------------------------------------

    group_rows: float = 200.0
    """Independent rows that two groups are told apart by, however many there are: beyond some
    hundreds the difference of real physics from every group decides, no longer the noise."""
    beaten_share: float = 0.15
    """Share that is large. So much of the squared error left a free form must take away on unseen
    stretches to be carried beside names, or to show that it is no noise: a cause named rightly leaves
    noise, of which no curve predicts any, and real gears are a little beyond their formulas. Of the
    evidence of the best candidate the quick ranking misjudges no more."""
    scatter_sure: float = 5.0
    """Standard errors from which on noise is said to come from a joint. Chance reaches 3 of a
    handful of stretches now and then; of those cases the rightly named stay below 4, four with a
    link that jumps or an encoder that rounds reach 6 to 25."""
    curve_room: float = 1.05
    """Curves are carried although effects that imitate the cause leave this much less on unseen
    stretches: they carry no parameter of an effect that is not there."""

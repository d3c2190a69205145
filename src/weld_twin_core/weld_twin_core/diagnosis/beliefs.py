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
    data are refused as unsound lie in `soundness.limits`.

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
    close_share: float = 0.15
    """The same as a share of the best: what the ranking misjudges grows with the effect."""
    invisible: float = 0.12
    """RMS change of the residual [noise] below which a lone effect is not worth a name, however
    many rows vouch for it. A judgement."""
    negligible: float = 0.25
    """RMS change of the residual [noise] below which an effect beside a larger one is not told
    from that one's misfit. A judgement."""
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
    from which on the kind is named; a tenth is what a calibration is worth doing for."""
    joint_worth: float = 0.1
    """Share of a kind from which on a joint of it is reported, and how nearly as well as the kind
    another must do to be reported beside it. A judgement."""
    member_least_m: float = 1e-6
    """RMS at the tool [m] below which a member is not listed: no instrument sees it."""

    # What unseen data say --------------------------------------------------------------------

    dependence_gain: float = 0.02
    """Share of the squared unseen error from which what a generic column explains is reported."""
    dependence_sure: float = 2.0
    """The same in standard errors between folds."""
    other_setup: float = 5.0
    """Times by which a held-out recording must fit better with a frame of its own to stem from
    another set-up. A judgement."""
    parted: float = 0.05
    """Share by which an alternative may leave more on held-out recordings than the effect in the
    model and still count as its like. Two errors told apart by less are one to a user."""
    farthest: float = 1.0
    """Logarithm of a ratio between two motions from which on it says no more about the interval:
    a model that leaves e times as much elsewhere fits neither."""

    # The verdict -----------------------------------------------------------------------------

    sure: float = 0.85
    """Share of the evidence from which on one name stands alone; not the `sure` of an answer."""
    listed: float = 0.03
    """Probability from which on an alternative is named beside a leader that is not sure."""
    unexplained: float = 0.05
    """Share of the squared gap that may stay unexplained before it is reported as something left, and
    before the answer is 'unknown' where nothing was found."""
    least_excess: float = 0.05
    """Share of the squared floor that a gap counts as standing above it at the least; keeps
    the share unexplained from a division by next to nothing."""
    above: float = 1.3
    """What remains must exceed an independently measured floor by this factor to count; the
    floor itself is known to a tenth or so, and noise has tails."""
    structure_gain: float = 0.03
    """Share of the squared unseen error that a structure must take away to count."""
    structure_sure: float = 3.0
    """What it must take away besides, in standard errors between folds."""
    blatant_gain: float = 0.15
    """Share from which on fewer standard errors do: few folds may hold all of a large one."""
    blatant_sure: float = 1.5
    """Standard errors that such a large structure must take away."""
    far_above: float = 1.7
    """What remains over the floor, RMS, from which the answer is 'unknown' where nothing was found
    and nothing shows the noise by itself. A Gaussian gives 1, one with trimmed outliers up to
    about 1.3; two causes outside the library (seed 515001) gave 1.9 and 2.6 and were called no gap
    without it. Between the two, nearer to the noise. A judgement."""

    # Place, dependence and name --------------------------------------------------------------

    group_share: float = 0.05
    """Share of the squared error so far that a free-form group must take away on unseen folds to
    be one of the few. On 8 development cases (seed 424202) with causes outside the library 0.02
    to 0.05 of the error at the start found the same places; below, a large gap lost its second."""
    group_steady: float = 2.0
    """The same fall over its standard error between folds: one chance in forty for each group."""
    group_rows: float = 200.0
    """Independent rows that two groups are told apart by, however many there are: beyond some
    hundreds the difference of real physics from every group decides, no longer the noise."""
    beaten_share: float = 0.15
    """Share of the squared error left that a free form must take away on unseen stretches to be
    carried beside names, or to show that it is no noise. A cause named rightly leaves noise, of which
    no curve predicts any; the share leaves room for what real gears are beyond their formulas."""
    beaten_steady: float = 2.0
    """The same in standard errors between folds."""
    scatter_sure: float = 5.0
    """Standard errors from which on noise is said to come from a joint. Chance reaches 3 of a
    handful of stretches now and then; of those cases the rightly named stay below 4, four with a
    link that jumps or an encoder that rounds reach 6 to 25."""
    curve_room: float = 1.05
    """Curves are carried although effects that imitate the cause leave this much less on unseen
    stretches: they carry no parameter of an effect that is not there."""
    level_shared: float = 0.7
    """Belief that what several joints do alike has one cause, and not one each. A judgement."""

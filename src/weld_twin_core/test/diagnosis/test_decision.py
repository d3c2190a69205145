# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The verdict on evidence given by hand, on each side of every boundary.

Expected numbers are worked out here from plain literals, never from the beliefs themselves, so
that a belief which moves by a quarter makes a test fail.
"""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from weld_twin_core.diagnosis.beliefs import Beliefs
from weld_twin_core.diagnosis.evidence import Alternative, Evidence, Left, Scatter, beyond_doubt
from weld_twin_core.diagnosis.result import Family, Site, Structure
from weld_twin_core.diagnosis.verdict.decision import decide

ELBOW, WRIST = 'elbow_joint', 'wrist_1_joint'
PLAY, OFFSET = Site('backlash', ELBOW), Site('joint_offset', WRIST)
GEAR, DRIFT = Site('gear_ratio', WRIST), Site('drift', None)
FLOOR = 3.5e-5


def candidate_set(*pairs):
    """Return an effect found with its alternatives, from sites and probabilities."""
    fit = SimpleNamespace(model=SimpleNamespace(found=()))
    return tuple(Alternative(site, 0.0, fit, probability) for site, probability in pairs)


def left_over(gain, sure=9.0, names=('time',)):
    return Structure(2e-5, gain, sure, names)


def taking(left):
    """Return a structure that takes that share of the evidence of `structured`."""
    return left_over(left * (1.0 - 0.09) / 0.25)


def evidence(*candidate_sets, **changes):
    """Return evidence of a large gap that is explained down to the floor."""
    usual = Evidence(
        candidate_sets=candidate_sets,
        structure=left_over(0.0, 0.0, ()),
        gap=1e-3,
        after=FLOOR,
        floor=FLOOR,
        independent=True,
        parts=(1.0 / max(len(candidate_sets), 1),) * len(candidate_sets),
        believed=(0.9,) * len(candidate_sets),
    )
    return replace(usual, **changes)


def structured(left, *candidate_sets, **changes):
    """Return evidence of which a structure takes that share of the squared gap above the floor."""
    return evidence(
        *candidate_sets,
        **{
            'structure': taking(left),
            'gap': 1e-3,
            'after': 0.5e-3,
            'floor': 0.3e-3,
            'independent': False,
            **changes,
        },
    )


SURE = candidate_set((PLAY, 1.0))


# Who is named, and what is none --------------------------------------------------------------------


def above(times, **changes):
    """Return evidence of a gap of so many floors of which nothing is explained."""
    return evidence(gap=times * FLOOR, after=times * FLOOR, **changes)


def led(*probabilities):
    return evidence(candidate_set(*zip((PLAY, OFFSET, DRIFT), probabilities, strict=False)))


def with_strays(times, **changes):
    """Return the same of readings without ten that stand out."""
    stand_out = tuple(str(k) for k in range(11, 21))
    return above(times, strays=stand_out, with_strays=2.5 * FLOOR, **changes)


def less_what_is_left(part, after):
    """
    Return a gap of 1 mm with noise of 0.3 mm: 0.68 mm leave about half of the square to the name.

    That is so by whatever its part is told.
    """
    return evidence(SURE, gap=1e-3, after=after, floor=0.3e-3, parts=(part,))


def found_beside(left):
    sizes = {'parts': (0.01, 0.5), 'gap': 0.6e-3, 'after': 0.55e-3}
    return structured(left, SURE, OPEN, **sizes)


BASE, OPEN = Site('base_pose', None), candidate_set((OFFSET, 0.5), (GEAR, 0.5))
PAIR, DOUBTED = (SURE, candidate_set((OFFSET, 1.0))), candidate_set((PLAY, 0.99))
MASS = 'payload with mass -10.5 kg'
STRAYS = 'those at 11, 12, 13, 14, 15, 16, 17, 18 and 2 others do'
ONE, UNSAID = ((PLAY,),), {'independent': False}
PARTED = {'believed': (0.9, 0.2), 'parts': (0.9, 0.1)}
VERDICTS = {
    'a leader is named alone from 85 percent on': (led(0.85, 0.15), 'identified', ONE, None),
    'before, it is not': (led(0.84, 0.16), 'ambiguous', ((PLAY, OFFSET),), 'backlash of elbow'),
    'an alternative is named from 3 percent on': (
        led(0.7, 0.25, 0.03), 'ambiguous', ((PLAY, OFFSET, DRIFT),), ''),
    'before, it is none': (led(0.7, 0.25, 0.029), 'ambiguous', ((PLAY, OFFSET),), ''),
    'a set begins with the effect of fewest numbers': (
        evidence(candidate_set((BASE, 0.7), (OFFSET, 0.3))), 'ambiguous', ((OFFSET, BASE),), ''),
    'what cannot be told apart is said': (
        evidence(SURE, OPEN), 'ambiguous', ((PLAY,), (OFFSET, GEAR)),
        'joint_offset of wrist_1_joint, gear_ratio of wrist_1_joint'),
    'a name counts that is likelier right than wrong': (
        evidence(SURE, believed=(0.51,)), 'identified', ONE, None),
    'as likely is not enough': (evidence(SURE, believed=(0.5,)), 'unknown', (), ''),
    'unlikely names that explain less': (
        evidence(*PAIR, believed=(0.9, 0.2), parts=(0.6, 0.4)), 'identified', ONE, ''),
    'unlikely names that explain more': (
        evidence(*PAIR, believed=(0.9, 0.2), parts=(0.4, 0.6)), 'unknown', ONE, str(OFFSET)),
    'a cause without a name as likely as not': (
        evidence(*PAIR, **PARTED, nameless=0.5), 'identified', ONE, ''),
    'a cause without a name likelier than not': (
        evidence(*PAIR, **PARTED, nameless=0.51), 'unknown', ONE, ''),
    'as likely as not beside one name': (evidence(SURE, nameless=0.5), 'identified', ONE, None),
    'likelier than not beside one name': (
        evidence(SURE, nameless=0.51), 'unknown', ONE, 'not in the library'),
    **{f'after {after}, part {part}': (less_what_is_left(part, after), status, ONE, '')
       for after, status in ((0.65e-3, 'identified'), (0.75e-3, 'unknown')) for part in (1.0, 0.3, 3.0)},
    'what is found stays told beside what is left': (
        found_beside(0.6), 'unknown', ((PLAY,), (OFFSET, GEAR)), ''),
    'beside all that is left, too': (found_beside(0.9), 'unknown', ((PLAY,), (OFFSET, GEAR)), ''),
    'what no machine has': (
        evidence(DOUBTED, refused=(MASS,), believed=(0.3,)), 'unknown', (), (MASS, str(PLAY))),
    'what no machine has alone': (evidence(refused=(MASS,)), 'unknown', (), ''),
    'what was taken out': (
        evidence(DOUBTED, lacking=('friction of elbow',), believed=(0.3,)), 'unknown', (),
        ('friction of elbow', str(PLAY))),
    'without an effect a twentieth may be left': (structured(0.049), 'none', (), ''),
    'more than a twentieth may not': (structured(0.051), 'unknown', (), ''),
    'what depends on nothing looked at': (above(2.0), 'unknown', (), 'something not looked at'),
    'nothing found and nothing left': (
        evidence(gap=FLOOR), 'none', (), 'there is no gap above the noise'),
    'a gap above an independent floor': (above(1.31), 'unknown', (), ''),
    'a gap within what such a floor may be off': (
        above(1.29), 'none', (), 'no gap above the noise'),
    'poses are to be repeated where nothing shows the noise': (
        above(1.31, **UNSAID), 'none', (), 'repeat some poses'),
    'little more than what the fit leaves': (
        above(1.29, **UNSAID), 'none', (), 'no gap above the noise'),
    'spread as noise may be': (above(1.68, **UNSAID), 'none', (), 'repeat some poses'),
    'spread far wider than noise': (above(1.7, **UNSAID), 'unknown', (), 'far wider'),
    'readings that stand out of noise': (with_strays(1.29), 'none', (), STRAYS),
    'readings that stand out of what may be noise': (
        with_strays(1.29, **UNSAID), 'none', (), STRAYS),
    'readings that stand out of a gap': (with_strays(1.31), 'unknown', (), 'what remains depends'),
    'readings that stand out of who knows what': (
        with_strays(1.31, **UNSAID), 'none', (), 'repeat some poses'),
    'readings that stand out hide no structure': (
        structured(0.5, gap=1e-4, strays=('station 4',), with_strays=1e-3), 'unknown', (), ''),
}  # fmt: skip
"""Evidence, the status and sets it comes to, and words of the first reason and the last, if any."""


@pytest.mark.parametrize('name', VERDICTS)
def test_a_verdict_is_what_its_evidence_comes_to(name):
    told, status, sets, words = VERDICTS[name]
    verdict = decide(told)
    assert (verdict.status, verdict.sets) == (status, sets)
    if words is None:
        assert verdict.reasons == ()
    elif words:
        first, last = words if isinstance(words, tuple) else (words, words)
        assert first in verdict.reasons[0] and last in verdict.reasons[-1]


def test_beliefs_that_are_given_decide():
    told = evidence(candidate_set((PLAY, 0.9), (OFFSET, 0.1)))
    assert decide(told).status == 'identified'
    assert decide(told, Beliefs(sure=0.95)).status == 'ambiguous'


@pytest.mark.parametrize(
    ('joint', 'after', 'sets', 'status'),
    [
        (ELBOW, 0.8e-3, ((OFFSET,),), 'unknown'),
        (WRIST, 0.8e-3, ((PLAY,), (OFFSET,)), 'unknown'),
        (WRIST, 0.2e-3, ((PLAY,), (OFFSET,)), 'identified'),
    ],
)
def test_noise_that_comes_from_a_joint_has_no_name_and_its_mean_is_no_lost_motion(
    joint, after, sets, status
):
    """It leaves the cause unknown where it is more of the gap than what is named."""
    both = SURE, candidate_set((OFFSET, 1.0))
    noisy = Scatter(joint, 0.79, 13.0)
    verdict = decide(evidence(*both, gap=1e-3, after=after, floor=1e-4, scattered=(noisy,)))
    assert (verdict.status, verdict.sets) == (status, sets)
    reason = (
        f'what remains is no noise of the instrument: 79 % of it lies along the motion of {joint}'
    )
    assert (reason in verdict.reasons) is (status == 'unknown')
    # The same where nothing was found.
    verdict = decide(evidence(gap=FLOOR, scattered=(Scatter(joint, 0.2, 6.0),)))
    assert (verdict.status, verdict.sets) == ('unknown', ())
    assert '20 % of it lies along the motion of' in verdict.reasons[0]


def test_the_number_of_causes_alone_says_nothing_against_them():
    sites = [Site('link_length', f'joint_{k}') for k in range(8)]
    for count in range(1, 9):
        verdict = decide(evidence(*(candidate_set((site, 1.0)) for site in sites[:count])))
        assert verdict.status == 'identified'
        assert verdict.sets == tuple((site,) for site in sites[:count])


# What is left -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ('gain', 'sure', 'counts'),
    [
        (0.031, 9.0, True),
        (0.029, 9.0, False),
        (0.1, 3.1, True),
        (0.1, 2.9, False),
        (0.16, 2.0, True),
        (0.14, 2.0, False),
        (0.5, 1.6, True),
        (0.5, 1.4, False),
    ],
)
def test_a_structure_counts_that_is_sure_or_so_large_that_it_need_not_be(gain, sure, counts):
    case = Left(evidence(structure=left_over(gain, sure)), Beliefs())
    assert case.structured is counts
    assert case.above_noise is counts


@pytest.mark.parametrize(
    ('times', 'independent', 'high'),
    [(1.31, True, True), (1.29, True, False), (1.31, False, False)],
)
def test_what_remains_must_exceed_an_independent_floor_by_30_percent(times, independent, high):
    case = Left(evidence(after=times * FLOOR, independent=independent), Beliefs())
    assert case.above_noise is high


def test_what_is_left_is_a_share_of_the_squared_gap_above_the_floor():
    sizes = {'after': 4.0, 'floor': 2.0, 'gap': 8.0}
    assert Left(evidence(**sizes), Beliefs()).share == pytest.approx(12.0 / 60.0)
    found = evidence(structure=left_over(0.1), **{**sizes, 'independent': False})
    # A floor that only the fit shows may be too low by the square of 1.3.
    assert Left(found, Beliefs()).share == pytest.approx((16.0 - 3.38**2) / 60.0)
    near = evidence(structure=left_over(0.1), **{**sizes, 'floor': 2.4, 'independent': False})
    assert Left(near, Beliefs()).share == pytest.approx(1.6 / (64.0 - 2.4**2))
    both = evidence(structure=left_over(0.9), **sizes)
    assert Left(both, Beliefs()).share == pytest.approx(14.4 / 60.0)
    assert Left(evidence(after=9.0, floor=2.0, gap=8.0), Beliefs()).share == 1.0


def test_a_structure_is_a_share_of_what_there_is_to_share():
    chance = evidence(structure=left_over(0.1, 1.0), after=4.0, floor=3.5, gap=8.0)
    assert Left(chance, Beliefs()).share == 0.0
    told = evidence(structure=left_over(0.1), after=0.4, floor=2.0, gap=2.0)
    assert Left(told, Beliefs()).share == pytest.approx(0.1 * 0.16 / (0.05 * 4.0))
    told = evidence(after=0.5e-9, floor=0.0, gap=0.0, independent=False)
    found = replace(told, structure=left_over(0.2), independent=True)
    assert Left(found, Beliefs()).share == pytest.approx(0.25)


# Many small errors ------------------------------------------------------------------------------


def family(effect, rms=3e-5, size=1e-4, growths=(0.5, 0.5), like=(), chosen=True):
    site = Site(effect, ELBOW)
    return Family(effect, growths, chosen, ((site, size),), rms, ((site, 1.0),), like)


def of_families(*families, **changes):
    return decide(structured(0.0, families=families, believed=(0.9,), **changes))


def test_many_small_errors_that_explain_nothing_are_none():
    noise = {'gap': FLOOR, 'after': FLOOR}
    verdict = of_families(family('link_length', growths=(0.0, -0.1)), **noise)
    assert (verdict.status, verdict.families) == ('none', ())


@pytest.mark.parametrize(
    ('growths', 'named'),
    [
        ((0.11, 0.11, 0.0), True),
        ((0.11, 0.11, -0.001), False),
        ((0.09, 0.09, 5.0), False),
        ((0.0, 0.09, 0.11, 0.2), True),
        ((0.5,), False),
        ((), False),
    ],
)
def test_a_kind_is_named_without_which_the_error_grows_by_a_tenth_and_shrinks_nowhere(
    growths, named
):
    verdict = of_families(family('link_length', growths=growths))
    assert verdict.families[0].named is named
    assert verdict.sets == (((Site('link_length', ELBOW),),) if named else ())


def test_a_kind_that_others_take_the_place_of_is_not_named_however_much_it_does_alone():
    assert not of_families(family('link_length', growths=(9.0, 9.0), chosen=False)).sets


def test_what_would_do_as_well_as_a_kind_is_told_beside_it():
    sag, gear = Site('joint_compliance', ELBOW), Site('gear_ratio', ELBOW)
    verdict = of_families(family('link_length', like=((sag, 0.6), (gear, 0.05))))
    assert verdict.sets == ((Site('link_length', ELBOW), sag),)
    assert verdict.status == 'ambiguous'


def test_families_of_which_none_is_needed_leave_the_cause_unknown():
    verdict = of_families(
        *(family(n, growths=(0.05, 0.05)) for n in ('link_length', 'link_twist'))
    )
    assert verdict.status == 'unknown' and not verdict.sets
    assert 'takes the place' in verdict.reasons[1]


@pytest.mark.parametrize(
    ('size', 'rms', 'count'), [(1.1e-6, 3e-5, 1), (0.9e-6, 0.9e-6, 0), (0.9e-6, 3e-5, 1)]
)
def test_a_kind_is_told_where_the_fit_of_all_has_a_micrometre_of_it_or_unseen_data_miss_it(
    size, rms, count
):
    families = of_families(family('link_length', rms=rms, size=size)).families
    assert [one.named for one in families] == [True] * count


def test_families_are_told_largest_first_and_what_they_account_for():
    verdict = of_families(family('link_twist', 2e-5), family('link_length', 3e-5))
    assert [f.effect for f in verdict.families] == ['link_length', 'link_twist']
    assert verdict.families[0].rms_m == pytest.approx(3e-5)


@pytest.mark.parametrize(
    ('left', 'status'),
    [(0.0, 'identified'), (0.9, 'unknown')],
)
def test_kinds_are_told_and_the_status_says_if_they_are_all(left, status):
    told = structured(left, families=(family('link_length'),), structure=taking(left))
    verdict = decide(told)
    assert (verdict.status, len(verdict.sets)) == (status, 1)


def test_joints_at_which_a_kind_is_one_error_are_one_set():
    parallel = tuple(Site('link_offset', joint) for joint in ('joint_2', 'joint_3'))
    needed = (*((site, 0.4) for site in parallel), (Site('link_offset', ELBOW), 0.2))
    offsets = replace(family('link_offset'), needed=needed, alike=(parallel,))
    assert of_families(offsets).sets == (parallel, (Site('link_offset', ELBOW),))
    # Together they count, though each by itself has less than a joint of its own would need.
    needed = (*((site, 0.06) for site in parallel), (Site('link_offset', ELBOW), 0.88))
    assert parallel in of_families(replace(offsets, needed=needed)).sets


# The beliefs themselves -------------------------------------------------------------------------


def test_beliefs_cannot_be_changed_by_accident():
    with pytest.raises(AttributeError):
        Beliefs().sure = 0.5


@pytest.mark.parametrize(
    ('gain', 'sure', 'chance', 'there'),
    [
        (0.033, 3.2, 0.0, True),
        (0.027, 3.2, 0.0, False),
        (0.033, 2.8, 0.0, False),
        (0.16, 1.6, 0.0, True),  # much, though few parts hold all of it
        (0.16, 1.4, 0.0, False),
        (0.14, 1.6, 0.0, False),
        (0.16, 5.0, 0.2, False),
    ],
)
def test_a_structure_counts_by_how_much_it_takes_off_and_how_surely(gain, sure, chance, there):
    found = Structure(1e-4, gain, sure, ('time',), chance)
    assert beyond_doubt(found, Beliefs()) is there

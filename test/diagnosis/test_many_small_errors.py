# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Ripple lines of high order, and families of small errors, against hand-made truths."""

from types import SimpleNamespace

import numpy as np
import pytest
from diagnosis_cells import SIGMA, SIGMA_TURN, effect, known_scale, recorded, sites, tiny

from weld_twin_core import Beliefs, Twin, diagnose, load
from weld_twin_core.diagnosis.algebra.columns import Maker
from weld_twin_core.diagnosis.algebra.fit import fit
from weld_twin_core.diagnosis.answer.named_effects import _named_sets
from weld_twin_core.diagnosis.evidence import Evidence, Verdict
from weld_twin_core.diagnosis.many import fitted_together
from weld_twin_core.diagnosis.many.small_errors import Lines, groups, lines_of, with_lines
from weld_twin_core.diagnosis.many.weighed_families import _Case, weighed_families
from weld_twin_core.diagnosis.result import Site, Structure
from weld_twin_core.diagnosis.unseen.unseen_stretches import Unseen
from weld_twin_core.diagnosis.verdict.decision import decide


def ripple(joint, order, amplitude=0.0, phase=0.0):
    return effect(
        'transmission_ripple', joint=joint, amplitude=[amplitude], order=[order], phase=[phase]
    )


def dense(robot):
    """Return the ripple that a search for lines adds to: one low order, of no size yet."""
    return tuple(ripple(joint, 1.0) for joint in robot.joint_names)


def told(model):
    """Return the orders above the dense ones, by joint."""
    out = {e.joint: [n for n in np.atleast_1d(e.order) if n > 100] for e in model.found}
    return {joint: orders for joint, orders in out.items() if orders}


def test_two_narrow_lines_are_found_where_they_are_and_nowhere_else():
    true = (ripple('elbow_joint', 256.0, 1.5e-4, 0.7), ripple('wrist_2_joint', 131.0, 3e-4, -2.0))
    problem, model = tiny(true, count=400)
    found = with_lines(
        problem, model.with_found(dense(model.robot)), known_scale(problem), Beliefs()
    )
    assert told(found) == {'elbow_joint': [256.0], 'wrist_2_joint': [131.0]}


@pytest.mark.parametrize(
    ('dense', 'count', 'anew'), [(True, 150, True), (True, 300, False), (False, 3, False)]
)
def test_sizes_of_many_are_learned_anew_without_a_part_unless_that_takes_minutes(
    monkeypatch, dense, count, anew
):
    learned, parts = [], SimpleNamespace(whole=np.full(3, 2.0), rms=np.mean)
    ways = SimpleNamespace(every_way=lambda: [parts])
    monkeypatch.setattr(fitted_together.Unseen, 'of', lambda *_: ways)
    monkeypatch.setattr(
        fitted_together, 'predicted', lambda *_: learned.append(1) or np.full(3, 5.0)
    )
    final = SimpleNamespace(coordinates=np.zeros(count), model=None)
    few = dict.fromkeys(('problem', 'scale', 'precision'))
    result = SimpleNamespace(dense=dense, final=final, work=SimpleNamespace(beliefs=None), **few)
    assert fitted_together.unseen_rms(result) == (5.0 if anew else 2.0)
    assert len(learned) == anew


def test_noise_alone_has_no_lines():
    problem, model = tiny((), count=400, seed=3)
    found = with_lines(
        problem, model.with_found(dense(model.robot)), known_scale(problem), Beliefs()
    )
    assert told(found) == {}


@pytest.mark.parametrize('turned', [True, False])
def test_the_score_of_a_line_is_the_fall_of_least_squares(turned):
    problem, model = tiny((ripple('elbow_joint', 150.0, 1e-4, 0.3),), count=120, turned=turned)
    scale = known_scale(problem)
    maker = Maker(problem, problem.features(model), scale)
    lines = Lines.of(maker, ripple('elbow_joint', 1.0), np.array([150.0]))
    residual = problem.whitened(problem.residuals(model), scale)
    chi, k, step = lines.peak(residual)
    columns, target = by_differences(problem, model, 150.0), rows(problem.residuals(model)[0])
    solved, left, *_ = np.linalg.lstsq(columns, target, rcond=None)
    after = residual - lines.explained(k, step)
    assert float(residual @ residual - after @ after) == pytest.approx(chi, rel=1e-6)
    assert chi == pytest.approx(float(target @ target - left[0]), rel=1e-4)
    np.testing.assert_allclose(step, solved, rtol=1e-3)
    assert chi > Beliefs().line_chi2


def rows(part):
    """Return a residual (c, M) in units of noise, one row after the other."""
    unit = np.array([SIGMA] * 3 + [SIGMA_TURN] * 3)[: len(part)]
    return (part / unit[:, None]).ravel()


def by_differences(problem, model, order):
    """Return what sine and cosine of an order do, by moving the twin a little, (rows, 2)."""
    step, before = 1e-6, problem.residuals(model)[0]
    out = []
    for phase in (0.0, np.pi / 2.0):
        moved = model.with_found((ripple('elbow_joint', order, step, phase),))
        out.append(rows(before - problem.residuals(moved)[0]) / step)
    return np.array(out).T


def test_a_joint_that_hardly_moves_has_no_waves():
    problem, model = tiny((), count=50, static=False)
    maker = Maker(problem, problem.features(model), known_scale(problem))
    travel = np.ptp(maker.features[0].view.q, axis=0)
    for joint in np.array(model.robot.joint_names)[travel < 1.0]:
        assert lines_of(maker, ripple(str(joint), 1.0), 1.0) is None
    assert (travel < 1.0).any()


def test_a_family_of_three_shares_a_size_and_a_pair_is_free():
    names = ('shoulder_lift_joint', 'elbow_joint', 'wrist_1_joint')
    found = (
        *(effect('link_length', joint=name, da=1e-4) for name in names),
        *(effect('joint_offset', joint=name, offset=1e-4) for name in names[:2]),
        effect(
            'transmission_ripple',
            joint='elbow_joint',
            amplitude=[1e-4] * 4,
            order=[1.0, 2.0, 20.0, 300.0],
            phase=[0.0] * 4,
        ),
    )
    labels, scales = groups(found, Beliefs())
    assert labels.shape == scales.shape == (3 + 2 + 8,)
    assert len(set(labels[:3])) == 1
    assert labels[0] >= 0
    assert (labels[3:5] == -1).all()
    low, middle, high = labels[5:9], labels[9:11], labels[11:]
    assert len(set(low)) == 1
    assert low[0] not in (-1, labels[0])
    assert (middle == -1).all()
    assert (high == -1).all()


@pytest.fixture(scope='module')
def families():
    """Return a fit of two families of which one is at work, its unseen data, and the truth."""
    names = ('shoulder_lift_joint', 'elbow_joint', 'wrist_1_joint')
    true = tuple(
        effect('link_length', joint=name, da=size)
        for name, size in zip(names, (3e-4, -2e-4, 2.5e-4), strict=True)
    )
    problem, model = tiny(true, count=160)
    trial = tuple(effect('link_length', joint=name, da=1e-5) for name in names)
    trial += tuple(effect('link_twist', joint=name, dalpha=1e-6) for name in names)
    scale = known_scale(problem)
    result = fit(problem, model.with_found(trial), scale)
    return problem, model, true, result, Unseen.of(problem, scale, result, np.zeros(0))


def judged(families):
    """Return the verdict on the two families."""
    result, unseen = families[3:]
    found = SimpleNamespace(final=result, problem=unseen.problem, precision=np.ones(6))
    weighed = weighed_families(found, unseen, Beliefs()).families
    return decide(
        Evidence(
            candidate_sets=(),
            structure=Structure(1e-4, 0.0, 0.0, ()),
            gap=4e-4,
            after=5e-5,
            floor=SIGMA * np.sqrt(3.0),
            independent=False,
            parts=(),
            families=weighed,
            believed=(0.9,),
        )
    )


def test_the_family_at_work_is_named_and_accounts_for_what_it_moves(families):
    problem, model, true = families[:3]
    verdict = judged(families)
    told = {f.effect: f for f in verdict.families}
    recording = problem.recordings[0]
    t = recording.measured.t
    moved = (
        Twin(model.robot, true).poses(recording, t).position
        - Twin(model.robot).poses(recording, t).position
    )
    assert told['link_length'].named and verdict.status == 'identified'
    assert told['link_length'].rms_m == pytest.approx(
        np.sqrt((moved**2).sum(axis=1).mean()), rel=0.05
    )
    assert 'link_twist' not in told or not told['link_twist'].named
    assert [site.joint for site, _ in told['link_length'].members] == [
        'shoulder_lift_joint',
        'wrist_1_joint',
        'elbow_joint',
    ]


def test_a_fine_ripple_that_two_short_recordings_tell_together_is_named():
    # 24 stations over four radians tell waves up to 18 to a turn, twice as many up to 36.
    robot = load('ur5')
    ripple = {'effect': 'transmission_ripple', 'joint': 'elbow_joint'}
    ripple |= {'amplitude': 4e-4, 'order': 29, 'phase': 0.7}
    runs = [recorded(robot, [ripple], seed, static=24, name=f'run {seed}') for seed in (3, 4)]
    found = diagnose(runs, robot, experiment=False)
    assert sites(found) == [{('transmission_ripple', 'elbow_joint')}]
    assert found.effects[0].effect.order == 29
    assert found.status == 'identified'


class LeastSquares:
    """What plain least squares of one column an effect leaves on parts left out in turn."""

    def __init__(self, columns, target, parts):
        self.columns, self.target, self.parts = columns, target, parts

    def predict(self, kept):
        out, kept = np.array(self.target), list(kept)
        for part in np.unique(self.parts):
            used = self.parts != part
            step, *_ = np.linalg.lstsq(self.columns[kept][:, used].T, self.target[used])
            out[~used] -= step @ self.columns[kept][:, ~used]
        return out

    @staticmethod
    def squares(left):
        return left**2


@pytest.mark.parametrize('size, chosen', [(0.6, ['link_length', 'link_twist']), (0.0, [])])
def test_two_kinds_that_show_only_together_are_chosen_together(size, chosen):
    """Each takes 4 % off by itself, and both take all."""
    common, own, noise = np.random.default_rng(5).normal(size=(3, 400))
    columns, parts = np.array([common + 0.3 * own, common - 0.3 * own]), np.arange(400) // 50
    view = LeastSquares(columns, size * own + 0.05 * noise, parts)
    effects = tuple(effect(kind, joint='elbow_joint') for kind in ('link_length', 'link_twist'))
    case = _Case(load('ur5'), frozenset(), effects, (view,), parts, worth=0.1)
    assert case.chosen() == chosen
    assert max(np.median(case.growth([k], [])) for k in (0, 1)) < 0.1


@pytest.mark.parametrize(
    ('losses', 'least', 'most'),
    [
        ([0.0, 0.01, 0.0, 0.02, 0.0, 0.0, 0.01, 0.0], 0.99, 1.0),
        ([0.14, 0.15, 0.16, 0.15, 0.14, 0.16, 0.15, 0.15], 0.0, 0.01),
        ([0.23, 0.42, 0.14, 0.02, 0.0, 0.07, 0.3, 0.17], 0.1, 0.5),
        ([0.15], 0.0, 0.5),
    ],
)
def test_a_kind_is_told_from_another_only_where_the_parts_agree(monkeypatch, losses, least, most):
    """Where the other leaves half a tenth more than a tenth in the median part, but not in every."""
    monkeypatch.setattr(_Case, 'growth', lambda case, kept, less: np.array(losses))
    effects = tuple(effect(kind, joint='elbow_joint') for kind in ('link_length', 'link_twist'))
    case = _Case(load('ur5'), frozenset(), effects, (), np.zeros(1, dtype=int), worth=0.1)
    assert least <= case._does_as_well([1], [0]) <= most


@pytest.mark.parametrize(
    ('moves', 'reported'), [((True, True), 0), ((False, True), 1), ((False, False), 0)]
)
def test_of_a_set_that_member_is_reported_which_the_fit_of_all_kinds_has(moves, reported):
    kinds = ('joint_offset', 'joint_compliance')
    model = tuple(effect(kind, joint='elbow_joint') for kind in kinds)
    verdict = Verdict('ambiguous', (tuple(Site(kind, 'elbow_joint') for kind in kinds),))
    assert _named_sets(model, verdict, (), moves) == [(reported, 0)]

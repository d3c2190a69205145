# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The pages of effects and of plausible sizes list what there is, and their example runs."""

import re
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml

from weld_twin_core import Effect, Robot, Twin, effects_from_list
from weld_twin_core.effects import REGISTRY, JointOffset
from weld_twin_core.effects.hooks import OF_GROUP, TRAITS
from weld_twin_core.effects.plausible import table
from weld_twin_core.effects.registry import ELSE, way

DOCS = Path(__file__).parents[2] / 'docs'
sys.path.append(str(DOCS / '_ext'))

from range_rows import effect_rows, range_rows  # noqa: E402

PAGE = (DOCS / 'effects.md').read_text(encoding='utf-8')
BUNDLED = {k: kind for k, kind in REGISTRY.items() if kind.__module__.startswith('weld_twin')}
BY_HAND = (
    '`backlash` | joint | `width` rad | `form` | order | yes | all',
    '`transmission_ripple` | joint | `amplitude` rad, `order` 1/rev, `phase` rad |  |  | no '
    '| all but `order`',
    '`friction` | joint | `windup` rad, `asymmetry` -, `travel` rad, `recovery` 1/s | `release` | time, '
    'velocity | yes | all',
    '`thermal_growth` | links | `coefficient` 1/K, `warming_time` s | `reference`, `links`, `warmup` '
    '| temperature | no | all',
    '`measurement_noise` | robot | `sigma` m |  |  | no | none',
)


def test_the_page_has_a_row_for_every_effect_in_the_order_in_which_they_act():
    assert '```{weld-twin-effects}' in PAGE
    names = [row[0].strip('`') for row in effect_rows()]
    assert len(names) == len(set(names)) and set(names) >= set(BUNDLED)
    order = [names.index(name) for name in ('vibration', 'backlash', 'payload', 'drift')]
    assert order == sorted(order)


def test_a_row_says_what_the_effect_is():
    rows = {row[0]: row for row in effect_rows()}
    for line in BY_HAND:
        found = rows[line.partition(' ')[0]]
        assert ' | '.join([*found[:4], *found[5:]]) == line


def test_every_effect_tells_its_formula_and_no_other_has_the_same():
    told = [kind.traits.formula for kind in BUNDLED.values()]
    assert all(told) and len(set(told)) == len(told)


def test_what_parts_two_effects_is_told_of_effects_that_are_there():
    others = {other for kind in BUNDLED.values() for other in kind.traits.apart}
    assert others <= set(BUNDLED)
    words = way(['base_pose', 'tool_pose'])
    assert words == way(['tool_pose', 'base_pose']) == 'measure the tool by itself'
    assert way(['link_offset', 'link_offset']).startswith('only their sum moves the tool')
    assert way(['base_pose', 'base_pose']) == way(['drift', 'wear']) == ELSE


def hooks():
    """Return the hooks that the page lists."""
    table = PAGE.partition('## What else an effect may tell')[2]
    return re.findall(r'^\| `([\w.]+)` \|', table, flags=re.MULTILINE)


def test_the_page_lists_every_hook_once():
    own = {'gradient', 'needs', 'applicable', 'seeds', 'atoms', 'from_atoms', 'remedy'}
    grouped = {f'{group}.{name}' for name, group in OF_GROUP.items()}
    assert sorted(hooks()) == sorted(own | grouped | {f'traits.{name}' for name in TRAITS})


def test_an_effect_has_few_names():
    declared = {'name', 'of', 'stage', 'parameters'}
    assert len({k for k in dir(Effect) if not k.startswith('_')} | declared) <= 30


def test_hooks_where_version_0_1_had_them_still_tell():
    with pytest.warns(DeprecationWarning, match='Sag: depends_on, small, turned'):

        class Sag(JointOffset):
            depends_on = 'load'

            @classmethod
            def small(cls, view, joint, most):
                return [cls(joint, 1e-9)] * most

            def turned(self):
                return 'other side'

    (one, _) = Sag.search.small(None, 'elbow', 2)
    assert (Sag.traits.depends_on, Sag.traits.title) == ('load', JointOffset.traits.title)
    assert (one.offset, one.site, one.fit.turned()) == (1e-9, 'elbow', 'other side')
    assert (one.on, one.depends_on, one.coordinates().tolist()) == ('load', 'load', [1e-9])


def robot():
    joints = [{'name': name, 'a': 0.3} for name in ('shoulder', 'elbow_joint')]
    return Robot.from_mapping({'joints': joints})


def test_the_files_on_the_page_can_be_used():
    blocks = re.findall(r'```yaml\n(.*?)```', PAGE, re.DOTALL)
    assert len(blocks) == 2
    for block in blocks:
        assert effects_from_list(yaml.safe_load(block), robot())


def test_the_example_of_an_own_effect_runs():
    block = '\n'.join(re.findall(r'```python\n(.*?)```', PAGE, re.DOTALL))
    known = dict(REGISTRY)
    try:
        exec(compile(block, 'effects.md', 'exec'), {'__name__': 'example'})
        (mine,) = effects_from_list([{'effect': 'column_bend', 'bend': 0.01}], robot())
    finally:
        REGISTRY.clear()
        REGISTRY.update(known)
    _, pose = Twin(robot(), (mine,)).live().step(0.0, np.zeros(2))
    lean = 0.01 * 0.6**2
    np.testing.assert_allclose(
        pose.position, [0.6 * np.cos(lean), 0.0, -0.6 * np.sin(lean)], atol=1e-15
    )


def test_the_page_of_plausible_sizes_lists_every_figure():
    text = (DOCS / 'plausible.md').read_text(encoding='utf-8')
    assert text.count('{weld-twin-ranges}') == 2
    assert {row[:2] for row in range_rows(sliding=False)} == set(table())


def test_a_row_of_it_says_unit_spread_range_and_source():
    rows = {row[:2]: row[2:] for row in range_rows(sliding=True)}
    assert rows['backlash', 'width'][:4] == ('m', '5e-05', '0', '0.005')
    turning = {row[:2]: row[2:] for row in range_rows(sliding=False)}
    assert turning['payload', 'mass'][:4] == ('kg', '2', 'by robot', 'by robot')
    assert turning['vibration', 'frequency'][:4] == ('Hz', 'any', '1', '100')
    assert 'industrialmonitordirect.com' in turning['joint_offset', 'offset'][4]

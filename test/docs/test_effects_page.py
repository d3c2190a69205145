# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The page on effects lists what the registry has, and its example runs."""

import re
from pathlib import Path

import numpy as np
import pytest
import yaml

from weld_twin_core.arm.robot import Robot
from weld_twin_core.effects import REGISTRY, Effect, JointOffset, MemoryEffect, effects_from_list
from weld_twin_core.effects.hooks import OF_GROUP, TRAITS
from weld_twin_core.twin.twin import Twin

PAGE = (Path(__file__).parents[2] / 'docs' / 'effects.md').read_text(encoding='utf-8')
COLUMNS = ('of', 'parameters', 'options', 'definition', 'needs', 'memory', 'derivative')


def rows():
    """Return the cells of the table by effect."""
    out = {}
    for line in PAGE.splitlines():
        cells = [cell.strip() for cell in line.strip('|').split('|')]
        if line.startswith('| `') and len(cells) == len(COLUMNS) + 1:
            assert cells[0] not in out
            out[cells[0].strip('`')] = dict(zip(COLUMNS, cells[1:], strict=True))
    return out


ROWS = rows()
BUNDLED = {k: kind for k, kind in REGISTRY.items() if kind.__module__.startswith('weld_twin')}


def test_the_page_lists_exactly_the_registered_effects():
    assert set(ROWS) == set(BUNDLED)


@pytest.mark.parametrize('name', BUNDLED)
def test_the_page_says_what_the_effect_is(name):
    kind, row = BUNDLED[name], ROWS[name]
    assert row['of'] == kind.of
    assert row['parameters'] == ', '.join(f'`{p.name}` {p.unit}' for p in kind.parameters)
    assert tuple(re.findall(r'`(\w+)`', row['options'])) == kind.options
    assert set(filter(None, row['needs'].split(', '))) == kind.needs
    assert row['memory'] == ('yes' if issubclass(kind, MemoryEffect) else 'no')
    without = [p.name for p in kind.parameters if not p.differentiable]
    expected = 'all'
    if without:
        expected = 'all but ' + ', '.join(f'`{k}`' for k in without)
    if len(without) == len(kind.parameters):
        expected = 'none'
    assert row['derivative'] == expected


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

# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The page on effects lists what the registry has, and its example runs."""

import re
from pathlib import Path

import numpy as np
import pytest
import yaml

from weld_twin_core.arm.robot import Robot
from weld_twin_core.effects import REGISTRY, MemoryEffect, effects_from_list
from weld_twin_core.effects.hooks import Hooks
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
    return re.findall(r'^\| `(\w+)` \|', table, flags=re.MULTILINE)


def test_the_page_lists_every_hook_once():
    told = set(vars(Hooks)) | set(Hooks.__annotations__)
    contract = {'of', 'stage', 'site', 'at', 'on', 'key'}  # what every effect has, not a hook
    assert sorted(hooks()) == sorted(k for k in told - contract if not k.startswith('_'))


def robot():
    joints = [{'name': name, 'a': 0.3} for name in ('shoulder', 'elbow_joint')]
    return Robot.from_mapping({'joints': joints})


def test_the_files_on_the_page_can_be_used():
    blocks = re.findall(r'```yaml\n(.*?)```', PAGE, re.DOTALL)
    assert len(blocks) == 2
    for block in blocks:
        assert effects_from_list(yaml.safe_load(block), robot())


def test_the_example_of_an_own_effect_runs():
    (block,) = re.findall(r'```python\n(.*?)```', PAGE, re.DOTALL)
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

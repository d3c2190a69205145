# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The recipes of CONTRIBUTING: files dropped into a copy of the tree work without a line elsewhere."""

import shutil
import subprocess
import sys
from pathlib import Path
from textwrap import dedent

import pytest

ROOT = Path(__file__).parents[2]
EFFECT = '''
    """The neck of the torch bends under its own weight, by what of it is across the neck."""

    import numpy as np

    from .effect import LinearEffect, Traits, register
    from .view import Parameter, Stage, Value
    from .wording import size


    @register
    class TorchSag(LinearEffect):
        """The tool centre point hangs by ``droop`` where the tool's z axis is level."""

        droop: Value = 0.0

        name = 'torch_sag'
        of = 'robot'
        stage = Stage.POSE
        traits = Traits(
            title='sagging torch',
            meaning='the neck of the torch bends under its own weight',
            formula='p → p + droop · (down − (down · z) z), z along the tool',
            apart={'cartesian_compliance': 'hang a weight on the torch'},
            entered='program',
            depends_on='load',
            place='tool',
            changes_in_use=True,
            common=False,
        )
        parameters = (
            Parameter('droop', 'm', typical=2e-4, lower=0.0).plausible(
                (3e-4, 0.0, 5e-3), 'derived: half a metre of thin tube with 2 kg at its end'
            ),
        )

        def per_unit(self, view):
            gravity = np.asarray(view.robot.gravity)
            down = view.robot.T_world_base[:3, :3] @ gravity / np.linalg.norm(gravity)
            along = view.frames.rotation[..., :, 2]
            across = down - (along @ down)[..., None] * along
            return [{('pose', k): across[..., k] for k in range(3)}]

        def remedy(self, robot):
            return f'Stiffen the neck of the torch: it sags by {size(self.droop * 1e3)} mm.'
'''
PLANT = '''
    """The neck as a clamped beam under an even load, summed over pieces of it."""

    import numpy as np

    from .flaws import flaw


    @flaw('hand')
    def torch_sag(entry, here, pose):
        beyond = 1.0 - (np.arange(40) + 0.5) / 40
        tip = np.mean(0.5 * beyond**2 * beyond) / 0.125
        weight = pose.rotation[..., 2, :] * [-1.0, -1.0, 0.0]
        off = np.einsum('nij,nj->ni', pose.rotation, float(entry['droop']) * tip * weight)
        return pose._replace(position=pose.position + off)
'''
DIAGNOSED = """
    from types import SimpleNamespace
    import numpy as np
    import weld_twin_core as wt
    from diagnosis_cells import recorded
    from range_rows import cause_rows, effect_rows
    from small_arm import small_arm
    from weld_twin_core.diagnosis.result import NAMING
    from weld_twin_core.effects.registry import way
    from weld_twin_lab.blind.cause_sizes import FAMILIES
    from weld_twin_report.history.words import beforehand
    from weld_twin_report.report.diagnosis_page import report_page

    truth = [{'effect': 'torch_sag', 'droop': 6e-4}]
    held = np.array([[1, 0, 0, 0.1], [0, 0, -1, 0.05], [0, 1, 0, 0.2], [0, 0, 0, 1.0]])
    arm = small_arm().with_frames(tool=held)  # the torch across the last axis
    found = wt.diagnose([recorded(arm, truth, static=25)], arm)
    (one,) = found.effects
    # the map of nine numbers that the library has holds it, too
    assert one.effect.name == 'torch_sag' and found.status in NAMING, (found.status, found.effects)
    assert abs(one.effect.droop / 6e-4 - 1.0) < 0.05, one.effect.droop
    page = report_page(found)
    assert 'Stiffen the neck of the torch: it sags by 0.' in page
    assert 'sagging torch' in page and 'bends under its own weight' in page
    assert wt.effects.TorchSag is type(one.effect)
    assert 'torch_sag' in FAMILIES
    past = [SimpleNamespace(names=('torch_sag droop', 'drift xyz_rate'), effects=())]
    assert beforehand(past)['likely'] == {'torch_sag droop'}
    assert way(['cartesian_compliance', 'torch_sag']) == 'hang a weight on the torch'
    assert '`torch_sag`' in [row[0] for row in effect_rows()]
    assert 'sagging torch' in [title for title, _ in cause_rows()]
"""
FORM = r'''
    """Logs of a made-up tracker: a line with its name, then milliseconds and millimetres."""

    from ..formats import Format, form

    form(
        Format(
            'Vesper of Example',
            r'\A#VESPER\n',
            r'^clock',
            ((r'^clock$', 'time [ms]'), (r'^(?P<what>\w+) (?P<axis>[xyz])$', r'\g<axis> [mm]')),
            '\t',
        )
    )
'''
READ = """
    from pathlib import Path
    import numpy as np
    from weld_twin_msgs_py.tables.cells import read_cells

    rows = '\\n'.join(f'{20 * k}\\t{k}\\t1.5\\t2.5\\t0\\t0\\t0' for k in range(5))
    names = '\\t'.join(['clock', *(f'{w} {a}' for w in ('torch', 'base') for a in 'xyz')])
    Path('seen.log').write_text(f'#VESPER\\n{names}\\n{rows}\\n')
    found = read_cells('seen.log', None, None, marker='torch')
    assert found.header == ['time [ms]', 'x [mm]', 'y [mm]', 'z [mm]'], found
    assert found.numbers('x [mm]').tolist() == [0, 1, 2, 3, 4]
    assert found.said == ['read as the Vesper of Example writes it', "measured is 'torch'"]
"""
SECTION = '''
    """How many samples the answer stands on."""

    from .html import section, tag
    from .sections import on_page


    @on_page('answer', 45, words={'tally': 'how many samples the answer stands on'})
    def tally_section(page):
        count = page.diagnosis.gap.samples
        return section('Tally', tag('p', f'{count} samples were counted.'), id_='tally')
'''
DRAWN = """
    import diagnoses
    from range_rows import word_rows
    from weld_twin_report.report import report_page

    page = report_page(diagnoses.backlash())
    places = [page.index(f'id="{name}"') for name in ('seam', 'tally', 'where')]
    assert places == sorted(places), places
    assert f'{diagnoses.backlash().gap.samples} samples were counted.' in page
    assert ('tally', 'how many samples the answer stands on') in word_rows()
"""


RECIPES = {
    'an effect and its plant': (
        {'core/effects/torch_sag': EFFECT, 'lab/plant/torch_neck': PLANT},
        DIAGNOSED,
        ('test/diagnosis', 'src/weld_twin_core/test', 'docs/_ext'),
    ),
    'a form of table': ({'msgs_py/tables/forms/vesper': FORM}, READ, ()),
    'a section of the page': (
        {'report/report/tally': SECTION},
        DRAWN,
        ('src/weld_twin_report/test/report', 'docs/_ext'),
    ),
}
"""Files of each, by their places in the packages; what uses them, and which folders that needs."""


@pytest.fixture(scope='module')
def tree(tmp_path_factory):
    """Return a copy of all packages, side by side, with what Python compiled of them."""
    out = tmp_path_factory.mktemp('copy')
    for package in (ROOT / 'src').glob('weld_twin*'):
        shutil.copytree(package / package.name, out / package.name)
    return out


@pytest.mark.parametrize('name', RECIPES)
def test_what_a_recipe_adds_is_a_file_each_and_is_used(name, tree):
    files, code, beside = RECIPES[name]
    if 'plant' in name:
        pytest.importorskip('mujoco')
    for place, text in files.items():
        package, _, inside = place.partition('/')
        (tree / f'weld_twin_{package}/{inside}.py').write_text(dedent(text), encoding='utf-8')
    places = [str(tree), *(str(ROOT / folder) for folder in beside)]
    start = f'import sys; sys.path[:0] = {places!r}\n'
    done = subprocess.run(
        [sys.executable, '-c', start + dedent(code)], capture_output=True, text=True, cwd=tree
    )
    assert done.returncode == 0, done.stderr[-3000:]

# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The notebooks run from top to bottom, show pictures, and say what they set out to show."""

import tempfile
from pathlib import Path

import nbformat
import pytest
from jupyter_client.manager import AsyncKernelManager
from jupyter_core.utils import run_sync
from nbclient import NotebookClient

FOLDER = Path(__file__).parents[2] / 'examples'
SHOWN = {
    'first_diagnosis': ('status:     identified', 'backlash of elbow_joint'),
    'your_own_csv': ('joint_offset of elbow_joint', 'link_length of elbow_joint'),
    'your_own_urdf': ('tool at zero: [ 1.04 -0.    1.05] m', "['backlash']"),
    'live_nodes': ('300 poses of the twin, 300 measured poses',),
    'tolerance_study': ('of the robots', 'with half the tolerance of'),
    'an_effect_of_your_own': ('% sure, ', "with it:    sure, identified ['column_bend']"),
}
SMALLER = """
import importlib
for room, sizes in {}.items():
    vars(importlib.import_module(f'weld_twin_core.diagnosis.{{room}}')).update(sizes)
"""
"""What lets diagnoses in the kernel draw as few models as those of other tests."""
LARGEST = 10_000
"""Bytes of a notebook without outputs; one with them is ten times that."""


@pytest.fixture(scope='module')
def kernel(tmp_path_factory):
    """Return a kernel that runs one notebook after the other: what they load, it loads once."""
    place = tmp_path_factory.mktemp('kernel')
    with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        patch.setenv('JUPYTER_RUNTIME_DIR', str(place / 'run'))
        patch.setenv('IPYTHONDIR', str(place))
        patch.setenv('MPLBACKEND', 'module://matplotlib_inline.backend_inline')
        # On sockets, not on TCP; of the paths of sockets the system allows 107 letters.
        manager = AsyncKernelManager(kernel_name='python3', transport='ipc', ip=f'{folder}/socket')
        yield manager
        run_sync(manager.shutdown_kernel)(now=True)


def test_every_notebook_is_run_here():
    assert sorted(path.stem for path in FOLDER.glob('*.ipynb')) == sorted(SHOWN)


@pytest.mark.parametrize('name', SHOWN)
def test_a_notebook_is_kept_without_outputs(name):
    path = FOLDER / f'{name}.ipynb'
    cells = nbformat.read(path, as_version=4).cells
    assert path.stat().st_size < LARGEST
    assert [cell for cell in cells if cell.get('outputs') or cell.get('execution_count')] == []


@pytest.mark.parametrize('name', SHOWN)
def test_a_notebook_runs_and_shows_what_it_promises(name, tmp_path, kernel, fewer_models):
    if name == 'live_nodes':
        pytest.importorskip('rclpy', reason='needs ROS 2')
    book = nbformat.read(FOLDER / f'{name}.ipynb', as_version=4)
    # With names of its own, in a folder of its own.
    book.cells.insert(0, nbformat.v4.new_code_cell(f'%reset -f\n%cd -q {tmp_path}'))
    book.cells.insert(0, nbformat.v4.new_code_cell(SMALLER.format(fewer_models)))
    NotebookClient(book, km=kernel, timeout=120).execute()
    outputs = [out for cell in book.cells for out in cell.get('outputs', ())]
    assert any('image/png' in out.get('data', {}) for out in outputs), 'no picture'
    printed = ''.join(out.get('text', '') for out in outputs)
    assert [words for words in SHOWN[name] if words not in printed] == []
